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
    def alone(self) -> bool:
        """Whether nothing of the study, and nothing of the lab's, is in the run."""
        return {capture.object for capture in self.run.captures} <= set(self.names)

    def outputs(self) -> list[str]:
        """Page, summary and figures of every object."""
        files = ["report.html", "summary.csv"]
        files += [f"figures/{name}.{end}" for name in FIGURES for end in ("png", "svg")]
        return [self.run.results(f"{own}/{name}") for own in self.names for name in files]

    def captures(self, wildcards: Any) -> list[Described]:
        """Captures of an object."""
        return [c for c in self.run.described() if c["object"] == wildcards.object]

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
