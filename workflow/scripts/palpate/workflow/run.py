"""What one run of the workflow works on, once all that people wrote was read and checked."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from palpate.capture.discover import BACKGROUND, CaptureId, folder_fingerprint, sensor_folder
from palpate.config.probe import PARTS, asked
from palpate.config.sensor import HAND_EYE, asks_for_base
from palpate.solid.options import first_images
from palpate.workflow.lab_captures import says_simulated
from palpate.workflow.places import refuse
from palpate.yaml_files import load_yaml

LAB_TEMPLATE = "template.ply"
PROJECT = Path(__file__).resolve().parents[4]
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
        return {capture.object for capture in self.captures} - self._made

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

    def of_project(self, name: str) -> str:
        """A file of the project, wherever the run is."""
        path = PROJECT / name
        return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)

    def files(self, captures: Iterable[Described], *names: str) -> list[str]:
        """Results of captures, those of one capture after those of another."""
        return [
            self.results(f"{c['object']}/{c['sensor']}/{c['capture']}/{name}")
            for c in captures
            for name in names
        ]

    def recordings(self, captures: Iterable[Described]) -> list[str]:
        """Folders of captures."""
        return [self.raw(f"{c['object']}/{c['sensor']}/{c['capture']}") for c in captures]

    # What the configuration says of captures.

    @property
    def tracker(self) -> str:
        """Tracker whose surfaces the estimates are made from."""
        return "elastic"

    def sensor_spec(self, wildcards: Any) -> Mapping:
        """A sensor's file."""
        return self.sensors[wildcards.sensor]

    def probe_spec(self, wildcards: Any) -> Mapping:
        """File of the probe that an object is pressed with."""
        return self.probe_of(wildcards.object)

    def experiment_probe(self, wildcards: Any) -> Mapping | None:
        """File of the probe of the recordings about sensors, if one is named."""
        name = self.config["experiments"]["probe"]
        return self.probes[name] if name in self.probes else None

    def template(self, name: str) -> str:
        """Template of an object: its own file, or the one made of its scans."""
        kind, file = self.template_source(name)
        made = self.results(f"{name}/template.ply")
        return made if kind == "scans" else self.raw(f"{name}/{file}")

    # Inputs of rules.

    def film_of(self, name: str) -> Callable[[Any], str]:
        """A sensor's recording that determines a part of the probe."""
        part = next(one for one in PARTS if one.name == name)

        def film(wildcards: Any) -> str:
            folder = self.raw(f"sensors/{wildcards.sensor}/{part.recording}")
            if wildcards.sensor not in self.sensors_of(part.recording):
                refuse(
                    ValueError(
                        f"{folder}: folder: expected a recording of {part.shows}, found none"
                    )
                )
            return folder

        return film

    def template_of(self, wildcards: Any) -> str:
        """An object's template."""
        return self.template(wildcards.object)

    def scans_of(self, wildcards: Any) -> str:
        """Folder of an object's scans."""
        return self.raw(f"{wildcards.object}/{self.template_source(wildcards.object)[1]}")

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
        dropped = wildcards.object not in self._made
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
        parts = [*asked(self.probe_of(wildcards.object))]
        parts += [HAND_EYE] * asks_for_base(self.sensors[wildcards.sensor])
        return [self.results(f"sensors/{wildcards.sensor}/{part}.json") for part in parts]

    def first_cloud_of(self, wildcards: Any) -> str:
        """Clouds that begin with a capture's first; of others than Hertz's all are made anyway."""
        all_made = wildcards.capture in self.together(wildcards)
        return self.of_capture("clouds.npz" if all_made else "rest_cloud.npz")

    def table_of(self, wildcards: Any) -> str:
        """Indentation table of the point that a curve was recorded at."""
        return self.table(wildcards.object, wildcards.capture)

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
        spec, point = self.description_of(wildcards.object), wildcards.point
        first, chain = first_images(spec).get(point, (point, []))
        return first, [spec["mirrors"][number] for number in chain]

    def one(self, wildcards: Any) -> list[str]:
        """The capture of a direct estimate, by itself."""
        return [wildcards.capture]

    def together(self, wildcards: Any) -> list[str]:
        """Captures of an object with a sensor that are estimated directly, in order."""
        same = self.described_of("direct", wildcards.object)
        return [c["capture"] for c in same if c["sensor"] == wildcards.sensor]

    def direct_files(self, captures: Callable[[Any], Sequence[str]]) -> dict:
        """Inputs of a direct estimate, files of one kind in the order of the captures."""

        def each(name: str) -> Callable:
            return lambda wildcards: [
                self.results(f"{wildcards.object}/{wildcards.sensor}/{capture}/{name}")
                for capture in captures(wildcards)
            ]

        return {
            "object": self.raw("{object}/object.yaml"),
            "template": self.template_of,
            "alignments": each("alignment.json"),
            "paths": each("path.csv"),
            "clocks": each("clock.json"),
            "motions": each("motion.npz"),
            "tables": lambda wildcards: [
                self.table(wildcards.object, capture) for capture in captures(wildcards)
            ],
            "calibrations": self.calibrations_of,
        }

    # Fingerprints of what was dropped, as it was before the checks.

    def content(self, wildcards: Any, files: Iterable[str]) -> dict[str, str]:
        """Fingerprints of the dropped folders among a job's inputs; the lab's have rules."""
        dropped = [str(path) for path in files if self._is_dropped(path)]
        return {path: self.fingerprint_of(path) for path in dropped}

    def _is_dropped(self, path: str) -> bool:
        raw = Path(self.paths["raw"])
        if not Path(path).is_relative_to(raw) or not Path(path).is_dir():
            return False
        top, *rest = Path(path).relative_to(raw).parts
        if top == "sensors":
            return "/".join(rest) not in self.lab_experiments
        return top not in self._made

    def fingerprint_of(self, folder: str, *, linked: int = 0) -> str:
        """Fingerprint of a dropped folder, ``linked`` levels of which may be links."""
        known = self.seen.get(str(Path(folder))) or self._fingerprints.get(folder)
        if known is None:
            known = self._fingerprints[folder] = folder_fingerprint(folder, linked=linked)
        return known

    @cached_property
    def _fingerprints(self) -> dict[str, str]:
        return {}

    # Objects and captures.

    @property
    def objects(self) -> list[str]:
        """Names of the objects of the run and of the lab."""
        return sorted({c.object for c in (*self.captures, *self.curves, *self.simulated)})

    def probe_of(self, name: str) -> Mapping:
        """Probe of an object: declared by its object.yaml, or by the lab that is to write it."""
        spec = self.description_of(name)
        if "probe" not in spec:
            return {"indenter": {"radius_m": spec["curves"]["radius_m"]}}
        return self.probes[spec["probe"]]

    @property
    def lab_objects(self) -> list[str]:
        """Objects that the lab records in this run."""
        return sorted(self._made)

    @property
    def lab_folders(self) -> list[str]:
        """Folders of ``raw/`` that the lab writes into in this run."""
        sensors = {Path("sensors", name).parent for name in self.lab_experiments}
        names = [*self.lab_objects, *sorted(map(str, sensors))]
        return [self.raw(name) for name in [*names, *(["simulations"] if names else [])]]

    @property
    def made_materials(self) -> list[str]:
        """Objects of the run whose true material the lab knows."""
        return sorted({capture.object for capture in self.captures if capture in self.simulated})

    def materials(self) -> list[str]:
        """True material of each of those."""
        return [self.truth(f"{name}/material.json") for name in self.made_materials]

    @property
    def scanned(self) -> list[str]:
        """Objects whose templates are made of scans."""
        return [name for name in self.objects if self.template_source(name)[0] == "scans"]

    def groups(self, *names: str) -> list[dict[str, str]]:
        """Objects, all or these, and sensors whose captures are estimated together."""
        found = [c for name in names or self.objects for c in self.described_of("direct", name)]
        keys = ("object", "sensor", "provenance")
        kinds = sorted({tuple(c[key] for key in keys) for c in found})
        return [dict(zip(keys, kind, strict=True)) for kind in kinds]

    def joint_estimates(self) -> list[str]:
        """Estimate from all captures of each object with each sensor."""
        return [self.results(f"{g['object']}/{g['sensor']}/direct.json") for g in self.groups()]

    def first_tracked(self, name: str) -> list[dict[str, str]]:
        """First tracked capture of an object by each sensor."""
        mine = self.described_of("tracked", name)
        first = {capture["sensor"]: capture for capture in reversed(mine)}
        return [first[sensor] for sensor in sorted(first)]

    def sensors_of(self, experiment: str) -> list[str]:
        """Sensors of which there is an experiment, the lab's or dropped."""
        done = {Path(name) for name in self.lab_experiments}
        made = {path.parent.name for path in done if path.name == experiment}
        raw = Path(self.paths["raw"], "sensors")
        return sorted(made | {name for name in self.sensors if (raw / name / experiment).is_dir()})

    @property
    def lab_experiments(self) -> list[str]:
        """Experiments ``<sensor>/<experiment>`` that the lab records; never ones people dropped."""
        blocks = (self.lab or {}).get("experiments", {})
        names = [f"{sensor}/{name}" for name in blocks for sensor in blocks[name]["sensors"]]
        folder = Path(self.paths["raw"]) / "sensors"
        return [name for name in names if says_simulated(folder / name)]

    def template_source(self, name: str) -> tuple[str, str]:
        """What an object's template is: ``file`` or ``scans``, and its name in the folder."""
        template = {"file": LAB_TEMPLATE} | self.description_of(name)["template"]
        key = "scans" if "scans" in template else "file"
        return key, template[key]

    def described(self, which: str = "captures", *, simulated: bool = False) -> list[Described]:
        """Describe captures of the run, as tables name them: all, or those that a method runs on.

        With ``simulated`` just those that the lab makes.
        """
        return [
            {**vars(c), "point": c.point, "provenance": self._provenance_of(c.object)}
            for c in getattr(self, which)
            if not simulated or c in self.simulated
        ]

    def described_of(self, which: str, name: str) -> list[Described]:
        """Describe those of an object; asked for by each of its jobs."""
        if which not in self._by_object:
            found = self._by_object[which] = defaultdict(list)
            for capture in self.described(which):
                found[capture["object"]].append(capture)
        return list(self._by_object[which][name])

    @cached_property
    def _by_object(self) -> dict[str, dict[str, list[Described]]]:
        return {}

    def _provenance_of(self, name: str) -> str:
        return "simulated" if name in self._made else self.description_of(name)["provenance"]

    def description_of(self, name: str) -> Mapping:
        """object.yaml of an object, or what the lab is to write into it."""
        if name in self._made:
            return self.lab["objects"][name]["object"]
        if name not in self._descriptions:
            self._descriptions[name] = load_yaml(self.raw(f"{name}/object.yaml"))
        return self._descriptions[name]

    @cached_property
    def _descriptions(self) -> dict[str, Mapping]:
        return {}

    def lab_point(self, name: str, point: str) -> str:
        """Point of an object of the lab whose mechanics a point shares: its first mirror image."""
        spec = self.lab["objects"][name]
        points = spec["object"]["points"]
        if spec["shape"]["kind"] != "block" or "direction" in points[point]:
            return point
        wanted = _sizes(points[point])
        return next(
            other
            for other in sorted(points)
            if _sizes(points[other]) == wanted and "direction" not in points[other]
        )

    @cached_property
    def _made(self) -> frozenset[str]:
        return frozenset(capture.object for capture in self.simulated)


def one_of(names: Iterable[str]) -> str:
    """Pattern of a wildcard that takes just the given names."""
    return "|".join(sorted(names)) or "none"


def _sizes(point: Mapping) -> tuple[float, ...]:
    """Coordinates of a point without their signs, to the micrometre."""
    return tuple(round(abs(value), 6) for value in point["position_m"])
