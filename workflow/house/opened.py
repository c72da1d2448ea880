"""What one run of the workflow works on, once all that people wrote was read and checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from palpate.capture.discover import CaptureId

from house.lab_checks import says_simulated

LAB_TEMPLATE = "template.ply"


@dataclass(frozen=True)
class House:
    """What one run of the workflow works on.

    Attributes
    ----------
    paths : mapping
        Folders of the run (``paths`` of config.yaml).
    sensors, probes : mapping
        Specification by name, from one YAML file each.
    lab : mapping or None
        The virtual lab's configuration; None where the run has only dropped captures.
    captures : tuple of CaptureId
        Captures that the run uses, dropped in or to be made by the lab, sorted.
    tracked : tuple of CaptureId
        Those of them whose surfaces are tracked and whose errors are minimised.
    direct : tuple of CaptureId
        Those that E and nu are estimated of directly: the tracked, and repeated presses.
    simulated : frozenset of CaptureId
        All that the lab makes on demand.
    object_files : mapping
        object.yaml by name, of the objects that people recorded.
    seen : mapping
        Stamps of what stood in ``raw/`` before it was checked, by path.
    """

    paths: Mapping[str, str]
    sensors: Mapping[str, Mapping]
    probes: Mapping[str, Mapping]
    lab: Mapping | None
    captures: tuple[CaptureId, ...]
    tracked: tuple[CaptureId, ...]
    direct: tuple[CaptureId, ...]
    simulated: frozenset[CaptureId]
    object_files: Mapping[str, Mapping]
    seen: Mapping[str, str]

    @property
    def objects(self) -> list[str]:
        """Names of the objects of the run and of the lab."""
        return sorted({capture.object for capture in {*self.captures, *self.simulated}})

    @property
    def simulated_captures(self) -> list[CaptureId]:
        """Captures of the run that the lab makes."""
        return [capture for capture in self.captures if capture in self.simulated]

    def probe_of(self, name: str) -> Mapping:
        """Probe of an object: declared by its object.yaml, or by the lab that is to write it."""
        if self.made_by_lab(name):
            return self.probes[self.lab["objects"][name]["object"]["probe"]]
        return self.probes[self.object_files[name]["probe"]]

    @property
    def lab_experiments(self) -> list[str]:
        """Experiments ``<sensor>/<experiment>`` that the lab records; never ones people dropped."""
        blocks = (self.lab or {}).get("experiments", {})
        names = [f"{sensor}/{name}" for name in blocks for sensor in blocks[name]["sensors"]]
        folder = Path(self.paths["raw"]) / "sensors"
        return [name for name in names if says_simulated(folder / name)]

    def template_source(self, name: str) -> tuple[str, str]:
        """What an object's template is: ``file`` or ``scans``, and its name in the folder."""
        if self.made_by_lab(name):
            template = {"file": LAB_TEMPLATE} | self.lab["objects"][name]["object"]["template"]
        else:
            template = self.object_files[name]["template"]
        key = "scans" if "scans" in template else "file"
        return key, template[key]

    def described(
        self, *, simulated: bool = False, tracked: bool = False, direct: bool = False
    ) -> list[dict[str, str]]:
        """Describe the captures of the run, as tables name them.

        Parameters
        ----------
        simulated : bool, optional
            True: just those that the lab makes.
        tracked : bool, optional
            True: just those whose surfaces are tracked.
        direct : bool, optional
            True: just those that are estimated directly.
        """
        wanted = self.direct if direct else self.tracked if tracked else self.captures
        chosen = [c for c in wanted if c in self.simulated] if simulated else wanted
        return [
            {
                "object": c.object,
                "sensor": c.sensor,
                "capture": c.capture,
                "point": c.point,
                "provenance": self._provenance_of(c.object),
            }
            for c in chosen
        ]

    def description_of(self, name: str) -> Mapping:
        """object.yaml of an object, or what the lab is to write into it."""
        return (
            self.lab["objects"][name]["object"]
            if self.made_by_lab(name)
            else self.object_files[name]
        )

    def lab_point(self, name: str, point: str) -> str:
        """Point of an object of the lab whose mechanics a point shares: its first mirror image."""
        spec = self.lab["objects"][name]
        points = spec["object"]["points"]
        if spec["shape"]["kind"] != "block":
            return point
        wanted = _sizes(points[point])
        return next(other for other in sorted(points) if _sizes(points[other]) == wanted)

    def _provenance_of(self, name: str) -> str:
        return "simulated" if self.made_by_lab(name) else self.object_files[name]["provenance"]

    def made_by_lab(self, name: str) -> bool:
        """Whether the lab makes an object's captures."""
        return any(capture.object == name for capture in self.simulated)


def _sizes(point: Mapping) -> tuple[float, ...]:
    """Coordinates of a point without their signs, to the micrometre."""
    return tuple(round(abs(value), 6) for value in point["position_m"])
