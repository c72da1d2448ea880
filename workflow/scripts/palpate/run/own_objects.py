"""Objects of people's own: what is made of each, with nothing said of it in any configuration."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from palpate.run.objects import studied
from palpate.run.run import Described, Run

# Of Hertz fits in one figure.
MOST_FITS = 4
FIGURES = ("moduli", "hertz_fit", "surface")


@dataclass(frozen=True)
class OwnObjects:
    """Inputs and params of the rules of people's own objects, of a run.

    Attributes
    ----------
    run : Run
    """

    run: Run

    @property
    def names(self) -> list[str]:
        """Objects that are neither the study's nor the lab's."""
        captured = {capture.object for capture in self.run.captures}
        return sorted(captured - studied(self.run.config) - set(self.run.lab_objects))

    @property
    def summed(self) -> list[str]:
        """All objects of the run, each of which has a summary."""
        return sorted({one.object for one in (*self.run.captures, *self.run.curves)})

    def summaries(self, others: Sequence[str]) -> list[str]:
        """Summary of each of them and of others, by object."""
        names = sorted({*self.summed, *others})
        return [self.run.results(f"{name}/summary.csv") for name in names]

    @property
    def alone(self) -> bool:
        """Whether nothing of the study, and nothing of the lab's, is in the run."""
        return {capture.object for capture in self.run.captures} <= set(self.names)

    def outputs(self) -> list[str]:
        """Summary of every object, and page and figures of those whose methods they show."""
        files = ["report.html"]
        files += [f"figures/{name}.{end}" for name in FIGURES for end in ("png", "svg")]
        shown = self.names if self.run.shows_pages else []
        found = [self.run.results(f"{own}/{name}") for own in shown for name in files]
        return found + [self.run.results(f"{own}/summary.csv") for own in self.summed]

    def of(self, which: str) -> Callable[[Any], list[Described]]:
        """Captures of an object that a method runs on; see `Run.described`."""
        return lambda wildcards: [
            c for c in self.run.described(which) if c["object"] == wildcards.object
        ]

    def captures(self, wildcards: Any) -> list[Described]:
        """Captures of an object."""
        return self.of("captures")(wildcards)

    def minima(self, wildcards: Any) -> list[str]:
        """What the error minimisation finds of an object's captures."""
        return self.run.minima_of(self.captures(wildcards))

    def first(self, wildcards: Any) -> list[Described]:
        """First capture of an object by each sensor."""
        return self.run.first_tracked(wildcards.object)

    def fitted(self, wildcards: Any) -> list[Described]:
        """First captures of an object, as many as a figure of Hertz fits holds."""
        firsts = self.first(wildcards)
        rest = [c for c in self.captures(wildcards) if c not in firsts]
        return (firsts + rest)[:MOST_FITS]

    def groups(self, wildcards: Any) -> list[Described]:
        """Object and sensors whose captures are estimated together."""
        return [g for g in self.run.groups() if g["object"] == wildcards.object]

    def joint(self, wildcards: Any) -> list[str]:
        """Estimates from all captures of an object with a sensor."""
        folders = [f"{g['object']}/{g['sensor']}" for g in self.groups(wildcards)]
        return [self.run.results(f"{folder}/direct.json") for folder in folders]

    def sensors(self, wildcards: Any) -> list[Mapping]:
        """Sensors of the first captures of an object."""
        return [self.run.sensors[c["sensor"]] for c in self.first(wildcards)]

    def recorded(self, wildcards: Any) -> list[str]:
        """Folders of the first captures of an object."""
        return self.run.recordings(self.first(wildcards))

    def files(self, captures: Callable[[Any], Sequence[Described]], *names: str) -> Callable:
        """Files of an object's captures, those of one capture after those of another."""
        return lambda wildcards: self.run.files(captures(wildcards), *names)
