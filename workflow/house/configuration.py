"""Everything people write, read and checked once before the first job."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from palpate.capture.check import check_object
from palpate.capture.discover import NOT_OBJECTS, CaptureId, discover
from palpate.capture.fingerprint import stamps_below
from palpate.capture.schema import load_yaml, validate
from palpate.capture.words import one_line

from house.lab_checks import lab_problems, says_simulated
from house.path_checks import path_problems
from house.search_checks import impossible_search, unknown_objects, unknown_step_trackers
from house.sensor_checks import (
    ambiguous_boards,
    bent_transforms,
    dead_gauges,
    dropped_experiments,
    impossible_optics,
    missing_calibrations,
    unknown_probe,
    unlike_tips,
)
from house.trackers import tracker_problems

LAB_TEMPLATE = "template.ply"
# Snakemake leaves it in each folder that a rule wrote.
MADE_BY_A_RULE = ".snakemake_timestamp"
SCHEMAS = Path(__file__).resolve().parents[2] / "config" / "schemas"


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


def open_house(config: Mapping, *, source: str, files: bool = True) -> House:
    """Read and check what people write, and find the captures of the run.

    Parameters
    ----------
    config : mapping
        The merged configuration of the workflow.
    source : str
        File named in messages about it.
    files : bool, optional
        False: tables and images of captures are not opened, as jobs are to check them, and nothing
        is stamped.

    Raises
    ------
    ValueError
        With one line for each thing that is wrong.
    """
    problems = validate(config, SCHEMAS / "config.schema.yaml", source)
    if problems:
        raise ValueError("\n".join(problems))
    problems += path_problems(config["paths"], source)
    problems += impossible_search(config["minimise"], source)
    problems += tracker_problems(config["tracking"], source)
    problems += unknown_step_trackers(config, source)
    paths = config["paths"]
    sensors = _named_files(paths["sensors"], "sensor", problems)
    probes = _named_files(paths["probes"], "probe", problems)
    lab = _lab(paths["lab"], problems)
    if problems:
        raise ValueError("\n".join(map(one_line, problems)))
    seen = stamps_below(paths["raw"], only=config["only"]) if files else {}
    if lab is not None:
        problems += lab_problems(lab, sensors, paths["lab"])
    problems += ambiguous_boards(probes, paths["probes"]) + impossible_optics(sensors, paths)
    problems += bent_transforms(probes, sensors, paths) + dead_gauges(probes, paths["probes"])
    problems += unlike_tips(probes, paths["probes"])
    found = set(discover(Path(paths["raw"])))

    def chosen(name: str) -> bool:
        return config["only"] in (None, name)

    simulated = {
        capture
        for name, spec in (lab or {"objects": {}})["objects"].items()
        if chosen(name) and _is_the_labs(name, paths["raw"], found, problems)
        for capture in _recordings(name, spec, paths["lab"], sensors, probes, problems)
    }
    made, there = _by_object(simulated), _by_object(found)
    problems += _dropped_among(made, there, paths)
    for name in sorted(filter(chosen, _objects_in(paths["raw"]))):
        if not _still_the_labs(made.get(name, set()), there.get(name, set())):
            problems += check_object(Path(paths["raw"]) / name, sensors, probes, files=files)
    if config["only"] is None:
        problems += dropped_experiments(Path(paths["raw"]) / "sensors", sensors, lab)
    problems += unknown_probe(config["experiments"]["probe"], probes, source)
    selection = config["study"]["captures"]
    problems += _unknown_captures(config["study"], simulated, source)
    problems += unknown_objects(
        config, {*_objects_in(paths["raw"]), *(lab or {}).get("objects", {})}, source
    )
    wanted = sorted(
        capture
        for capture in found | simulated
        if chosen(capture.object) and (capture not in simulated or _selected(capture, selection))
    )
    surfaces = config["study"]["tracked"]
    tracked = [c for c in wanted if c not in simulated or _selected(c, surfaces)]
    estimated = _estimated(config["study"])
    direct = [c for c in wanted if c not in simulated or _selected(c, estimated)]
    problems += missing_calibrations({c.sensor for c in wanted}, sensors, lab, paths)
    if not wanted and not problems:
        problems.append(_nothing_found(paths, config["only"]))
    if problems:
        raise ValueError("\n".join(map(one_line, problems)))
    names = {capture.object for capture in wanted} - {capture.object for capture in simulated}
    files = {name: load_yaml(Path(paths["raw"]) / name / "object.yaml") for name in sorted(names)}
    return House(
        paths,
        sensors,
        probes,
        lab,
        tuple(wanted),
        tuple(tracked),
        tuple(direct),
        frozenset(simulated),
        files,
        seen,
    )


def _estimated(study: Mapping) -> Mapping:
    """Selection of what is estimated directly: the tracked, where nothing else is said."""
    return {**study["tracked"], **study.get("direct", {})}


def _selected(capture: CaptureId, selection: Mapping) -> bool:
    """Whether the study uses a recording of the lab; all are of an object that it does not name."""
    chosen = selection.get(capture.object)
    return chosen is None or capture.capture in chosen.get(capture.sensor, [])


def _unknown_captures(study: Mapping, simulated: set[CaptureId], source: str) -> list[str]:
    """Captures of the lab's objects that the study names and nobody records or the run leaves."""
    names = {capture.object for capture in simulated}
    used = {capture for capture in simulated if _selected(capture, study["captures"])}
    allowed = {
        "captures": (simulated, "recordings of the lab"),
        "tracked": (used, "some of study.captures"),
        "direct": (used, "some of study.captures"),
    }
    return [
        f"{source}: study.{part}.{name}.{sensor}: expected {words}, found {capture}"
        for part, (known, words) in allowed.items()
        for name, sensors in study.get(part, {}).items()
        if name in names
        for sensor, captures in sensors.items()
        for capture in captures
        if CaptureId(name, sensor, capture) not in known
    ]


def _sizes(point: Mapping) -> tuple[float, ...]:
    """Coordinates of a point without their signs, to the micrometre."""
    return tuple(round(abs(value), 6) for value in point["position_m"])


def _named_files(folder: str, kind: str, problems: list[str]) -> dict[str, Mapping]:
    found = {}
    for path in sorted(Path(folder).glob("*.yaml")):
        spec = _checked(path, SCHEMAS / f"{kind}.schema.yaml", problems)
        if spec is not None and spec[kind] != path.stem:
            problems.append(f"{path}: {kind}: expected {path.stem}, found {spec[kind]}")
        found[path.stem] = spec
    if not found:
        problems.append(f"{folder}: expected at least one {kind} file (*.yaml), found none")
    return found


def _lab(path: str | None, problems: list[str]) -> Mapping | None:
    return None if path is None else _checked(Path(path), SCHEMAS / "lab.schema.yaml", problems)


def _checked(path: Path, schema: Path, problems: list[str]) -> Mapping | None:
    try:
        spec = load_yaml(path)
    except ValueError as error:
        problems.append(str(error))
        return None
    wrong = validate(spec, schema, str(path))
    problems += wrong
    return None if wrong else spec


def _recordings(
    name: str, spec: Mapping, source: str, sensors: Mapping, probes: Mapping, problems: list[str]
) -> set[CaptureId]:
    """Captures that the lab makes of one of its objects."""
    field = f"{source}: objects.{name}"
    probe = spec["object"]["probe"]
    if probe not in probes:
        known = ", ".join(sorted(probes))
        problems.append(f"{field}.object.probe: expected one of {known}, found {probe}")
    for sensor in spec["recordings"]:
        if sensor not in sensors:
            known = ", ".join(sorted(sensors))
            problems.append(f"{field}.recordings: expected one of {known}, found {sensor}")
    return {
        CaptureId(name, sensor, str(capture))
        for sensor, captures in spec["recordings"].items()
        for capture in captures
    }


def _is_the_labs(name: str, raw: str, found: set[CaptureId], problems: list[str]) -> bool:
    """Whether the lab may write an object's folder: never one that people filled.

    It is the lab's when its object.yaml says so, or when there is none and every capture there
    carries the mark of a rule's output.
    """
    path = Path(raw) / name / "object.yaml"
    if path.is_file():
        try:
            return (load_yaml(path) or {}).get("provenance") == "simulated"
        except (ValueError, AttributeError):
            return False
    captures = [Path(raw, c.object, c.sensor, c.capture) for c in found if c.object == name]
    if all((folder / MADE_BY_A_RULE).is_file() for folder in captures):
        return True
    problems.append(f"{path}: file: expected YAML, found nothing")
    return False


def _objects_in(raw: str) -> set[str]:
    folder = Path(raw)
    names = folder.iterdir() if folder.is_dir() else ()
    return {
        path.name
        for path in names
        if path.is_dir() and not path.name.startswith(".") and path.name not in NOT_OBJECTS
    }


def _by_object(captures: Iterable[CaptureId]) -> dict[str, set[CaptureId]]:
    groups = defaultdict(set)
    for capture in captures:
        groups[capture.object].add(capture)
    return groups


def _dropped_among(
    made: Mapping[str, set[CaptureId]], there: Mapping[str, set[CaptureId]], paths: Mapping
) -> list[str]:
    """Captures that people dropped into an object of the lab, which would pass for simulated."""
    strange = sorted(c for name in made for c in there.get(name, set()) - made[name])
    folders = [Path(paths["raw"], c.object, c.sensor, c.capture) for c in strange]
    return [
        f"{folder}: capture: expected the lab's alone in an object that {paths['lab']} makes,"
        " found another (give recordings an object of their own)"
        for folder in folders
        if not (folder / MADE_BY_A_RULE).is_file()
    ]


def _still_the_labs(made: set[CaptureId], there: set[CaptureId]) -> bool:
    """Whether the lab alone fills an object's folder, or has still to complete it."""
    return bool(made) and (there <= made or bool(made - there))


def _nothing_found(paths: Mapping, only: str | None) -> str:
    if only is not None:
        return f"only: expected an object of {paths['raw']}/ or of the lab, found {only}"
    return f"{paths['raw']}: expected captures (<object>/<sensor>/<capture>/), found none"
