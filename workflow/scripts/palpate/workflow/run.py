"""What one run of the workflow works on, once all that people wrote was read and checked."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from palpate.capture.discover import BACKGROUND, CaptureId, folder_fingerprint, sensor_folder
from palpate.config.probe import asked
from palpate.config.sensor import HAND_EYE, asks_for_base
from palpate.solid.options import first_images
from palpate.workflow.configuration_checks import says_simulated
from palpate.yaml_files import load_yaml

# A capture as tables name it.
Described = Mapping[str, str]


@dataclass(frozen=True)
class Run:
    """What one run of the workflow works on, and where its files are.

    Methods that take ``wildcards`` are for the rules: Snakemake calls them with each job's.

    Attributes
    ----------
    config : mapping
        The whole configuration, checked.
    sensors, probes : mapping
        Specification by name, from one YAML file each.
    lab : mapping or None
        The virtual lab's configuration; None where the run has only dropped captures.
    found : tuple of CaptureId
        Captures that are there, dropped in or to be made by the lab, sorted.
    curves : tuple of CaptureId
        Curves of force and position, without a camera; `CURVE` stands for their sensor.
    simulated : frozenset of CaptureId
        All that the lab makes on demand.
    seen : mapping
        Stamps of what stood in ``raw/`` before it was checked, by path.
    rules : iterable, optional
        The workflow's rules, for those that show it.
    """

    config: Mapping[str, Any]
    sensors: Mapping[str, Mapping]
    probes: Mapping[str, Mapping]
    lab: Mapping | None
    found: tuple[CaptureId, ...]
    curves: tuple[CaptureId, ...]
    simulated: frozenset[CaptureId]
    seen: Mapping[str, str]
    rules: Iterable[Any] = ()
    tracker = "elastic"  # whose surfaces the estimates are made from
    _by_object: dict[str, dict[str, list[Described]]] = field(default_factory=dict, init=False)

    # Captures by method.

    def chosen(self, which: str) -> Mapping[str, Mapping]:
        """Recordings of the lab by object and sensor, where a run uses or tracks not all of one."""
        return {}

    @cached_property
    def captures(self) -> tuple[CaptureId, ...]:
        """Those that the run uses."""
        return self._chosen(self.found, "captures")

    @cached_property
    def fitted(self) -> tuple[CaptureId, ...]:
        """Those of them that have a Hertz fit."""
        return self._asked("hertz", self.captures)

    @cached_property
    def tracked(self) -> tuple[CaptureId, ...]:
        """Those whose surfaces are tracked where somebody wants them."""
        return self._chosen(self.captures, "tracked")

    @cached_property
    def direct(self) -> tuple[CaptureId, ...]:
        """Those that E and nu are estimated of directly: the tracked, and repeated indentations."""
        return self._asked("direct", self._chosen(self.captures, "tracked", "direct"))

    def _chosen(self, captures: Iterable[CaptureId], *which: str) -> tuple[CaptureId, ...]:
        named = {name: sensors for one in which for name, sensors in self.chosen(one).items()}
        made = [c for c in self.simulated if c.object in named]
        left_out = {c for c in made if c.capture not in named[c.object].get(c.sensor, ())}
        return tuple(c for c in captures if c not in left_out)

    @property
    def own(self) -> set[str]:
        """Names of people's own objects, each of which gets a page of its own."""
        return {capture.object for capture in self.captures} - self.lab_objects

    def _asked(self, method: str, captures: Iterable[CaptureId]) -> tuple[CaptureId, ...]:
        """Captures that a method runs on; of people's own objects where they ask for it."""
        left_out = () if method in self.config["methods"] else self.own
        return tuple(c for c in captures if c.object not in left_out)

    def problems(self, objects: Collection[str], source: str) -> list[str]:
        """What a file of the configuration says of captures and objects that are not there."""
        return []

    # Places of files.

    @property
    def paths(self) -> Mapping[str, str]:
        """Folders of the run."""
        return self.config["paths"]

    def raw(self, path: str) -> str:
        """Path of a capture's file or folder."""
        return f"{self.paths['raw']}/{path}"

    def results(self, path: str) -> str:
        """Path of a result."""
        return f"{self.paths['results']}/{path}"

    def truth(self, path: str) -> str:
        """Path of what the lab knows of its captures."""
        return self.results(f"lab/{path}")

    def of_capture(self, name: str) -> str:
        """Pattern of a capture's result."""
        return self.results(f"{{object}}/{{sensor}}/{{capture}}/{name}")

    def files(self, captures: Iterable[Described], *names: str) -> list[str]:
        """Results of captures, those of one capture after those of another."""
        folders = [f"{c['object']}/{c['sensor']}/{c['capture']}" for c in captures]
        return [self.results(f"{folder}/{name}") for folder in folders for name in names]

    # Inputs and params of rules.

    def sensor_spec(self, wildcards: Any) -> Mapping:
        """A sensor's file."""
        return self.sensors[wildcards.sensor]

    def probe_spec(self, wildcards: Any) -> Mapping:
        """File of the probe that an object is pressed with; of curves alone the sphere's radius."""
        spec = self.descriptions[wildcards.object]
        if "probe" not in spec:
            return {"indenter": {"radius_m": spec["curves"]["radius_m"]}}
        return self.probes[spec["probe"]]

    def experiment_probe(self, wildcards: Any) -> Mapping | None:
        """File of the probe of the recordings about sensors, if one is named."""
        return self.probes.get(self.config["experiments"]["probe"])

    def template_of(self, wildcards: Any) -> str:
        """An object's template: its own file, or the one made of its scans."""
        name, template = wildcards.object, self.descriptions[wildcards.object]["template"]
        if "scans" in template:
            return self.results(f"{name}/template.ply")
        return self.raw(f"{name}/{template.get('file', 'template.ply')}")

    def scans_of(self, wildcards: Any) -> str:
        """Folder of an object's scans."""
        name = wildcards.object
        return self.raw(f"{name}/{self.descriptions[name]['template']['scans']}")

    def kept_mesh(self, wildcards: Any) -> str | list:
        """The object's kept solid mesh where there is one (pytetwild never repeats itself)."""
        kept = Path(self.paths["meshes"]) / f"{wildcards.object}.vtu"
        return str(kept) if kept.is_file() else []

    def optics_of(self, wildcards: Any) -> str | list:
        """A sensor's own calibration, where its file asks for it."""
        if self.sensors[wildcards.sensor].get("optics") != "calibration":
            return []
        return self.results(f"sensors/{wildcards.sensor}/calibration.json")

    def scene_of(self, wildcards: Any) -> str:
        """Folder that shows what an object stands on; clouds do without a background."""
        place = sensor_folder(Path(self.raw(f"{wildcards.object}/{wildcards.sensor}")))
        dropped = wildcards.object not in self.lab_objects
        return str(place.scene if dropped and self._in_clouds(wildcards) else place.background)

    def background_of(self, wildcards: Any) -> str | list:
        """Clouds of the empty scene where there are some; pictures have `mask_of` for it."""
        scene = self.scene_of(wildcards)
        return scene if self._in_clouds(wildcards) and Path(scene).name == BACKGROUND else []

    def mask_of(self, wildcards: Any) -> str | list:
        """Foreground of a capture's pictures; clouds have none."""
        return [] if self._in_clouds(wildcards) else self.of_capture("mask.npz")

    def _in_clouds(self, wildcards: Any) -> bool:
        return self.sensors[wildcards.sensor]["kind"] == "cloud"

    def calibrations_of(self, wildcards: Any) -> list[str]:
        """A sensor's own calibrations of the probe and of the base of poses, where files ask."""
        parts = [*asked(self.probe_spec(wildcards))]
        parts += [HAND_EYE] * asks_for_base(self.sensors[wildcards.sensor])
        return [self.results(f"sensors/{wildcards.sensor}/{part}.json") for part in parts]

    def first_cloud_of(self, wildcards: Any) -> str:
        """Clouds that begin with a capture's first; of others than Hertz's all are made anyway."""
        all_made = wildcards.capture in self.together(wildcards)
        return self.of_capture("clouds.npz" if all_made else "rest_cloud.npz")

    def table(self, name: str, capture: str) -> str:
        """Indentation table of an object at a capture's point."""
        return self.results(f"{name}/indentation-{capture.partition('-')[0]}.npz")

    def image_of(self, wildcards: Any) -> str | list:
        """Indentation table of the first point that a point is a mirror image of, if it is one."""
        first, _ = self._first_image(wildcards)
        return [] if first == wildcards.point else self.table(wildcards.object, first)

    def mirrors_of(self, wildcards: Any) -> list:
        """Normals of the mirrors that lead from a point's first image to it."""
        return self._first_image(wildcards)[1]

    def _first_image(self, wildcards: Any) -> tuple[str, list]:
        spec, point = self.descriptions[wildcards.object], wildcards.point
        first, chain = first_images(spec).get(point, (point, []))
        return first, [spec["mirrors"][number] for number in chain]

    def together(self, wildcards: Any) -> list[str]:
        """Captures of an object with a sensor that are estimated directly, in order."""
        same = self.described_of("direct", wildcards.object)
        return [c["capture"] for c in same if c["sensor"] == wildcards.sensor]

    def direct_files(self, captures: Callable[[Any], Sequence[str]]) -> dict:
        """Inputs of a direct estimate, files of one kind in the order of the captures."""

        def each(name: str) -> Callable:
            return lambda w: [
                self.results(f"{w.object}/{w.sensor}/{c}/{name}") for c in captures(w)
            ]

        return {
            "object": self.raw("{object}/object.yaml"),
            "template": self.template_of,
            "alignments": each("alignment.json"),
            "paths": each("path.csv"),
            "clocks": each("clock.json"),
            "motions": each("motion.npz"),
            "tables": lambda w: [self.table(w.object, c) for c in captures(w)],
            "calibrations": self.calibrations_of,
        }

    def content(self, wildcards: Any, files: Iterable[str]) -> dict[str, str]:
        """Fingerprints of a job's dropped folders, from before the checks; the lab's have rules."""
        dropped = [path for path in files if self._is_dropped(Path(path))]
        return {str(p): self.seen.get(str(Path(p))) or folder_fingerprint(p) for p in dropped}

    def _is_dropped(self, path: Path) -> bool:
        if not path.is_relative_to(self.paths["raw"]) or not path.is_dir():
            return False
        top, _, rest = path.relative_to(self.paths["raw"]).as_posix().partition("/")
        return rest not in self.lab_experiments if top == "sensors" else top not in self.lab_objects

    # Objects and captures.

    @property
    def objects(self) -> list[str]:
        """Names of the objects of the run and of the lab."""
        return sorted({c.object for c in (*self.captures, *self.curves, *self.simulated)})

    @cached_property
    def lab_objects(self) -> frozenset[str]:
        """Objects that the lab records in this run."""
        return frozenset(capture.object for capture in self.simulated)

    @property
    def lab_folders(self) -> list[str]:
        """Folders of ``raw/`` that the lab writes into in this run."""
        sensors = {Path("sensors", name).parent for name in self.lab_experiments}
        names = [*self.lab_objects, *sorted(map(str, sensors))]
        return [self.raw(name) for name in [*names, *(["simulations"] if names else [])]]

    @property
    def scanned(self) -> list[str]:
        """Objects whose templates are made of scans."""
        return [name for name in self.objects if "scans" in self.descriptions[name]["template"]]

    def groups(self, *names: str) -> list[dict[str, str]]:
        """Objects, all or these, and sensors whose captures are estimated together."""
        found = [c for name in names or self.objects for c in self.described_of("direct", name)]
        one_each = {(c["object"], c["sensor"]): c for c in found}.values()
        return [{key: c[key] for key in ("object", "sensor", "provenance")} for c in one_each]

    def first_tracked(self, name: str) -> list[dict[str, str]]:
        """First tracked capture of an object by each sensor."""
        first = {c["sensor"]: c for c in reversed(self.described_of("tracked", name))}
        return [first[sensor] for sensor in sorted(first)]

    @property
    def lab_experiments(self) -> list[str]:
        """Experiments ``<sensor>/<experiment>`` that the lab records; never ones people dropped."""
        blocks = (self.lab or {}).get("experiments", {})
        names = [f"{sensor}/{name}" for name in blocks for sensor in blocks[name]["sensors"]]
        return [name for name in names if says_simulated(Path(self.raw(f"sensors/{name}")))]

    def described(self, which: str = "captures") -> list[Described]:
        """Describe captures of the run as tables name them: all, or those of a method."""
        return [
            {**vars(c), "point": c.point, "provenance": self.descriptions[c.object]["provenance"]}
            for c in getattr(self, which)
        ]

    def described_of(self, which: str, name: str) -> list[Described]:
        """Describe those of an object; asked for by each of its jobs."""
        if which not in self._by_object:
            found = self._by_object[which] = defaultdict(list)
            for capture in self.described(which):
                found[capture["object"]].append(capture)
        return list(self._by_object[which][name])

    @cached_property
    def descriptions(self) -> Mapping[str, Mapping]:
        """object.yaml of each object, or what the lab is to write into it, by name."""
        dropped = [name for name in self.objects if name not in self.lab_objects]
        read = {name: load_yaml(self.raw(f"{name}/object.yaml")) for name in dropped}
        made = {name: self.lab["objects"][name]["object"] for name in self.lab_objects}
        return read | {name: spec | {"provenance": "simulated"} for name, spec in made.items()}

    def lab_point(self, name: str, point: str) -> str:
        """Point of an object of the lab whose mechanics a point shares: its first mirror image."""
        spec = self.lab["objects"][name]
        straight = {p: one for p, one in spec["object"]["points"].items() if "direction" not in one}
        if spec["shape"]["kind"] != "block" or point not in straight:
            return point
        # Coordinates without their signs, to the micrometre.
        sizes = {p: [round(abs(x), 6) for x in one["position_m"]] for p, one in straight.items()}
        return min(other for other in sizes if sizes[other] == sizes[point])


def one_of(names: Iterable[str]) -> str:
    """Pattern of a wildcard that takes just the given names."""
    return "|".join(sorted(names)) or "none"
