"""What a run of the study works on: those of the lab's recordings that it names, and minima."""

from collections.abc import Collection, Iterable, Mapping
from functools import cached_property
from os.path import isfile
from pathlib import Path
from typing import Any

from palpate.capture.discover import CaptureId
from palpate.workflow.run import Described, Run

PROJECT = Path(__file__).resolve().parents[3]
# Objects of the study beside its block.
BALL, EAR = "foam_ball", "ear"


class StudyRun(Run):
    """A run with the study's configuration; of objects that it does not name it takes all."""

    @property
    def study(self) -> Mapping:
        """The thesis's part of the configuration."""
        return self.config["study"]

    @property
    def tracker(self) -> str:
        """Tracker whose surfaces the estimates are made from."""
        return self.config["tracking"]["estimate_from"]

    def chosen(self, which: str) -> Mapping[str, Mapping]:
        """Recordings of the lab that the study uses, tracks, or estimates directly."""
        return self.study[which]

    @cached_property
    def minimised(self) -> tuple[CaptureId, ...]:
        """Those of the tracked captures whose errors are minimised."""
        return self._asked("minimise", self.tracked)

    @property
    def own(self) -> set[str]:
        """Names of people's own objects, which are not the study's either."""
        return super().own - {self.study["block"], BALL, EAR, *self.study["captures"]}

    def problems(self, objects: Collection[str], source: str) -> list[str]:
        """Recordings that the lab does not make; options of unknown objects.

        A misspelt name would have no effect. A run of dropped captures keeps the options of
        objects that ``study.captures`` names.
        """
        used = self.simulated.intersection(self.captures), "some of study.captures"
        parts = {"captures": (self.simulated, "recordings of the lab")}
        parts |= {"tracked": used, "direct": used}
        lines = [
            f"{source}: study.{part}.{name}.{sensor}: expected {words}, found {capture}"
            for part, (there, words) in parts.items()
            for name, sensors in self.study[part].items()
            for sensor, captures in sensors.items()
            for capture in captures
            if name in self.lab_objects and CaptureId(name, sensor, capture) not in there
        ]
        known = sorted({*objects, *self.study["captures"]})
        return lines + [
            f"{source}: {block}.objects: expected one of {', '.join(known)}, found {name}"
            for block in ("tracking", "minimise")
            for name in self.config[block]["objects"]
            if name not in known
        ]

    @property
    def errors(self) -> list[str]:
        """Error options of the minimisation."""
        return self.config["error_options"]

    @property
    def minima(self) -> list[str]:
        """Names of what the minimisation finds of a capture."""
        return [f"minimise-{error}.json" for error in self.errors]

    def minima_of(self, captures: Iterable[Described]) -> list[str]:
        """Minima of those captures whose errors are minimised, by capture and then by error."""
        known = set(self.minimised)
        return self.files([c for c in captures if captured(c) in known], *self.minima)

    def with_minima(self, captures: Iterable[Described]) -> list[Described]:
        """Those of captures of earlier runs whose minima are there."""
        return [c for c in captures if all(map(isfile, self.files([c], *self.minima)))]

    @property
    def search(self) -> Mapping:
        """Options of the minimisation, without what single objects and steps have."""
        return {k: v for k, v in self.config["minimise"].items() if k not in ("objects", "steps")}

    def search_of(self, wildcards: Any) -> Mapping:
        """Options of the minimisation for an object."""
        return self.search | self.config["minimise"]["objects"].get(wildcards.object, {})

    @property
    def made_materials(self) -> list[str]:
        """Objects of the run whose true material the lab knows."""
        return sorted({capture.object for capture in self.captures if capture in self.simulated})

    def materials(self) -> list[str]:
        """True material of each of those."""
        return [self.truth(f"{name}/material.json") for name in self.made_materials]

    def sensors_of(self, experiment: str) -> list[str]:
        """Sensors of which there is an experiment, the lab's or dropped."""
        made, raw = self.lab_experiments, Path(self.raw("sensors"))
        places = {name: f"{name}/{experiment}" for name in sorted(self.sensors)}
        return [name for name, at in places.items() if at in made or (raw / at).is_dir()]

    def of_project(self, name: str) -> str:
        """A file of the project, wherever the run is."""
        path = PROJECT / name
        return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)

    def published(self, table: str) -> str:
        """A table that the study prints, of the project wherever the run is."""
        return self.of_project(f"config/published/{table}.csv")


def captured(described: Described) -> CaptureId:
    """The capture that is described."""
    return CaptureId(described["object"], described["sensor"], described["capture"])
