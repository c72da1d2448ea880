"""Objects of people's own: what is made of each, with nothing said of it in any configuration."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from os.path import isfile
from typing import Any

from palpate.workflow.run import Described, Run

# Of Hertz fits in one figure.
MOST_FITS = 4
DATA = ("force", "motion", "samples", "profile")


@dataclass(frozen=True)
class OwnObjects:
    """Inputs and params of the rules of people's own objects, of a run."""

    run: Run

    @property
    def names(self) -> list[str]:
        """Those objects, in order."""
        return sorted(self.run.own)

    @property
    def summed(self) -> list[str]:
        """All objects of the run, each of which has a summary."""
        return sorted({one.object for one in (*self.run.captures, *self.run.curves)})

    def summaries(self, others: Sequence[str]) -> list[str]:
        """Summary of each of them and of others, by object."""
        names = sorted({*self.summed, *others})
        return [self.run.results(f"{name}/summary.csv") for name in names]

    def outputs(self, figures: Iterable[str]) -> list[str]:
        """Summary of every object, and page, figures and data of those whose methods they show."""
        files = ["report.html", "datapackage.json", *(f"data/{name}.csv" for name in DATA)]
        files += [f"figures/{name}.{end}" for name in figures for end in ("png", "svg")]
        found = [self.run.results(f"{own}/{name}") for own in self.paged for name in files]
        return found + self.summaries(())

    @property
    def paged(self) -> list[str]:
        """Those of them that get a page."""
        return self.names if {"hertz", "direct"} <= set(self.run.config["methods"]) else []

    def pages(self) -> list[str]:
        """Pages that are there, of those objects."""
        found = [self.run.results(f"{own}/report.html") for own in self.names]
        return [path for path in found if isfile(path)]

    def of(self, which: str) -> Callable[[Any], list[Described]]:
        """Captures of an object that a method runs on; see `Run.described`."""
        return lambda wildcards: self.run.described_of(which, wildcards.object)

    def captures(self, wildcards: Any) -> list[Described]:
        """Captures of an object."""
        return self.run.described_of("captures", wildcards.object)

    def points(self, wildcards: Any) -> list[str]:
        """Points of an object's captures."""
        return list(dict.fromkeys(capture["point"] for capture in self.captures(wildcards)))

    def tables(self, wildcards: Any) -> list[str]:
        """Indentation tables of those points."""
        return [self.run.table(wildcards.object, point) for point in self.points(wildcards)]

    def first(self, wildcards: Any) -> list[Described]:
        """First capture of an object by each sensor."""
        return self.run.first_tracked(wildcards.object)

    def fitted(self, wildcards: Any) -> list[Described]:
        """First captures of an object, as many as a figure of Hertz fits holds."""
        firsts = self.first(wildcards)
        return [*firsts, *(c for c in self.captures(wildcards) if c not in firsts)][:MOST_FITS]

    def groups(self, wildcards: Any) -> list[Described]:
        """Object and sensors whose captures are estimated together."""
        return self.run.groups(wildcards.object)

    def joint(self, name: str = "direct.json") -> Callable[[Any], list[str]]:
        """Estimates from all captures of an object with a sensor, or files beside them."""
        return lambda wildcards: [
            self.run.results(f"{g['object']}/{g['sensor']}/{name}") for g in self.groups(wildcards)
        ]

    def masks(self, wildcards: Any) -> list[str]:
        """Masks of those first captures that have pictures."""
        seen = [c for c in self.first(wildcards) if "color" in self.run.sensors[c["sensor"]]]
        return self.run.files(seen, "mask.npz")

    def sensors(self, wildcards: Any) -> list[Mapping]:
        """Sensors of the first captures of an object."""
        return [self.run.sensors[c["sensor"]] for c in self.first(wildcards)]

    def optics(self, wildcards: Any) -> list[str]:
        """Calibrations of those that have one of their own."""
        own = [s["sensor"] for s in self.sensors(wildcards) if s.get("optics") == "calibration"]
        return [self.run.results(f"sensors/{name}/calibration.json") for name in own]

    def recorded(self, captures: Callable[[Any], Sequence[Described]]) -> Callable:
        """Folders of an object's captures."""
        place = "{object}/{sensor}/{capture}"
        return lambda wildcards: [self.run.raw(place.format(**c)) for c in captures(wildcards)]

    def files(self, captures: Callable[[Any], Sequence[Described]], *names: str) -> Callable:
        """Files of an object's captures, those of one capture after those of another."""
        return lambda wildcards: self.run.files(captures(wildcards), *names)
