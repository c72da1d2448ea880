"""Everything people write, read and checked once before the first job."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from palpate.capture.check import check_object
from palpate.capture.devices import PLACES, Devices, read_devices
from palpate.capture.discover import CURVE, NOT_OBJECTS, CaptureId, curve_files, discover, folders
from palpate.capture.fingerprint import stamps_below
from palpate.config.model import Model, problems
from palpate.workflow.configuration_checks import (
    dropped_experiments,
    estimated,
    lab_devices,
    missing_calibrations,
    missing_films,
    path_problems,
    selected,
    unknown_captures,
    unknown_objects,
    unknown_probe,
)
from palpate.workflow.lab_captures import (
    by_object,
    dropped_among,
    is_the_labs,
    recordings,
    still_the_labs,
)
from palpate.workflow.objects import studied
from palpate.workflow.options import config_problems, filled
from palpate.workflow.places import placed, who_said
from palpate.workflow.run import Run
from palpate.yaml_files import load_yaml, one_line


def no_problems(lab: Mapping, sensors: Mapping, source: str) -> list[str]:
    """Nothing, for those who have no lab."""
    return []


def open_run(
    config: Mapping,
    *,
    sources: Sequence[str],
    project: Path,
    told: Mapping = MappingProxyType({}),
    files: bool = True,
    lab_kind: type[Model] | None = None,
    check_lab: Callable = no_problems,
    blocks: Mapping[str, type[Model]] = MappingProxyType({}),
    rules: Iterable = (),
) -> Run:
    """Read and check what people write, and find the captures of the run.

    Parameters
    ----------
    config : mapping
        The merged configuration of the workflow; what it leaves out has its default.
    sources : sequence of str
        Files that it was read of, the first of them with the defaults.
    project : Path
        Folder of the project, whose devices serve where the run has none of its own.
    told : mapping, optional
        What the command line says of the configuration.
    files : bool, optional
        False: tables and images of captures are not opened, as jobs are to check them, and nothing
        is stamped.
    lab_kind : type, optional
        Model of a lab's configuration.
    check_lab : callable, optional
        What else is wrong with it, the sensors and the file's name given, as lines.
    blocks : mapping, optional
        Options of further blocks of the configuration, by name.
    rules : iterable, optional
        The workflow's rules, as they come.

    Raises
    ------
    ValueError
        With one line for each thing that is wrong.
    """
    source = sources[0]
    _require_none(config_problems(config, blocks, source), sources, told)
    config = filled(config, blocks)
    config["paths"] = placed(config["paths"], project)
    paths, problems = config["paths"], path_problems(config["paths"], source)
    lab = _lab(paths["lab"], lab_kind, problems)
    devices = {kind: _devices(kind, paths[kind], problems) for kind in PLACES}
    problems += _wrong_devices(devices, lab_devices(lab))
    _require_none(problems, sources, told)
    sensors, probes = (one.specs for one in devices.values())
    seen = stamps_below(paths["raw"], only=config["only"]) if files else {}
    problems = [] if lab is None else list(check_lab(lab, sensors, paths["lab"]))
    found = set(discover(Path(paths["raw"])))
    simulated = _simulated(config, found, lab, (sensors, probes), problems)
    problems += dropped_among(by_object(simulated), by_object(found), paths)
    problems += _wrong_objects(config, found, simulated, (sensors, probes), files=files)
    if config["only"] is None:
        problems += dropped_experiments(Path(paths["raw"]) / "sensors", sensors, lab)
    experiments = (lab or {}).get("experiments") or (Path(paths["raw"]) / "sensors").is_dir()
    if experiments and config["experiments"]["probe"]:
        problems += unknown_probe(config["experiments"]["probe"], probes, source)
    problems += unknown_captures(config["study"], simulated, source)
    names = {*_objects_in(paths["raw"]), *(lab or {}).get("objects", {})}
    problems += unknown_objects(config, names, source)
    taken = _taken(config, found, simulated)
    wanted = taken["captures"]
    curves = () if problems else _curves(config, Path(paths["raw"]), by_object(simulated))
    problems += missing_calibrations({c.sensor for c in wanted}, sensors, lab, paths)
    if not wanted and not curves and not problems:
        problems.append(_nothing_found(paths, config["only"], names))
    _require_none(problems, sources, told)
    own = _object_files(Path(paths["raw"]), (*wanted, *curves), simulated)
    used = {"sensors": {c.sensor for c in wanted}, "probes": {s.get("probe") for s in own.values()}}
    if config["only"] is None:
        used["sensors"] |= {folder.name for folder in folders(Path(paths["raw"]) / "sensors")}
    used["probes"] |= {config["experiments"]["probe"]} if experiments else set()
    _require_none(_wrong_devices(devices, used), sources, told)
    run = Run(
        config=config,
        paths=paths,
        sensors={name: spec for name, spec in sensors.items() if spec is not None},
        probes={name: spec for name, spec in probes.items() if spec is not None},
        lab=lab,
        simulated=frozenset(simulated),
        object_files=own,
        seen=seen,
        rules=rules,
        curves=curves,
        **taken,
    )
    pressed = {(c.object, c.sensor): run.probe_of(c.object) for c in wanted}
    filmed = config["experiments"]["probe"]
    _require_none(missing_films(pressed, lab, paths, filmed), sources, told)
    return run


def _require_none(problems: list[str], sources: Sequence[str], told: Mapping) -> None:
    if problems:
        raise ValueError("\n".join(one_line(who_said(line, sources, told)) for line in problems))


def _devices(kind: str, folder: str, problems: list[str]) -> Devices:
    """Files of sensors or probes; where there are none that is a problem."""
    try:
        return read_devices(kind, Path(folder), Path())
    except ValueError as error:
        problems.append(str(error))
        return Devices({}, {}, Path(folder))


def _wrong_devices(devices: Mapping[str, Devices], used: Mapping[str, Collection]) -> list[str]:
    """What is wrong with the files of some sensors and probes; those of others are left alone."""
    return [
        line
        for kind, names in used.items()
        for name, lines in devices[kind].problems.items()
        for line in lines * (name in names)
    ]


def _chosen(name: str, config: Mapping) -> bool:
    return config["only"] in (None, name)


def _simulated(
    config: Mapping,
    found: set[CaptureId],
    lab: Mapping | None,
    devices: tuple[Mapping, Mapping],
    problems: list[str],
) -> set[CaptureId]:
    """Captures of the run that the lab makes."""
    paths = config["paths"]
    return {
        capture
        for name, spec in (lab or {"objects": {}})["objects"].items()
        if _chosen(name, config) and is_the_labs(name, paths["raw"], found, problems)
        for capture in recordings(name, spec, paths["lab"], *devices, problems)
    }


def _wrong_objects(
    config: Mapping,
    found: set[CaptureId],
    simulated: set[CaptureId],
    devices: tuple[Mapping, Mapping],
    *,
    files: bool,
) -> list[str]:
    """What is wrong with objects that people dropped."""
    raw, made, there = config["paths"]["raw"], by_object(simulated), by_object(found)
    return [
        problem
        for name in sorted(_objects_in(raw))
        if _chosen(name, config)
        and not still_the_labs(made.get(name, set()), there.get(name, set()))
        for problem in check_object(Path(raw) / name, *devices, files=files)
    ]


def _taken(
    config: Mapping, found: set[CaptureId], simulated: set[CaptureId]
) -> dict[str, tuple[CaptureId, ...]]:
    """Captures of the run, and those of them that each method runs on, as `Run` has them."""
    study, methods, others = config["study"], config["methods"], studied(config)
    of_run = sorted(c for c in found | simulated if _chosen(c.object, config))
    captures = [c for c in of_run if c not in simulated or selected(c, study["captures"])]
    chosen = {
        name: [c for c in captures if c not in simulated or selected(c, selection)]
        for name, selection in (("tracked", study["tracked"]), ("direct", estimated(study)))
    }

    def asked(method: str, captures: list[CaptureId]) -> tuple[CaptureId, ...]:
        """Captures that a method runs on; of people's own objects where they ask for it."""
        runs = method in methods
        return tuple(c for c in captures if runs or c in simulated or c.object in others)

    return {
        "captures": tuple(captures),
        "tracked": tuple(chosen["tracked"]),
        "fitted": asked("hertz", captures),
        "minimised": asked("minimise", chosen["tracked"]),
        "direct": asked("direct", chosen["direct"]),
    }


def _curves(config: Mapping, raw: Path, simulated: Mapping) -> tuple[CaptureId, ...]:
    """Curves of the objects that declare some, none of the lab's."""
    return tuple(
        CaptureId(name, CURVE, path.stem)
        for name in sorted(_objects_in(str(raw)))
        if _chosen(name, config)
        and name not in simulated
        and curve_files(raw / name)
        and "curves" in load_yaml(raw / name / "object.yaml")
        for path in curve_files(raw / name)
    )


def _object_files(
    raw: Path, wanted: tuple[CaptureId, ...], simulated: set[CaptureId]
) -> dict[str, Mapping]:
    """object.yaml by name, of the objects that people recorded."""
    names = {capture.object for capture in wanted} - {capture.object for capture in simulated}
    return {name: load_yaml(raw / name / "object.yaml") for name in sorted(names)}


def _lab(path: str | None, kind: type[Model] | None, wrong: list[str]) -> Mapping | None:
    """Content of a lab's file; None where there is none or it is wrong, which lines then say."""
    if path is None:
        return None
    try:
        spec = _like_another(Path(path))
    except ValueError as error:
        wrong.append(str(error))
        return None
    lines = problems(kind, spec, path) if kind else []
    wrong += lines
    return None if lines else kind.plain(spec) if kind else spec


def _like_another(path: Path) -> object:
    """Content of a file; where it says nothing, that of the file that it is ``like``."""
    spec = load_yaml(path)
    if not isinstance(spec, Mapping) or not isinstance(spec.get("like"), str):
        return spec
    other = load_yaml(Path(spec["like"]))
    if not isinstance(other, Mapping):
        raise ValueError(f"{spec['like']}: expected a mapping, found {other}")
    return _changed(other, {key: value for key, value in spec.items() if key != "like"})


def _changed(before: Mapping, changes: Mapping) -> dict:
    """Mapping with the changes of another, block by block."""
    both = before.keys() & changes.keys()
    blocks = {k for k in both if isinstance(before[k], Mapping) and isinstance(changes[k], Mapping)}
    return {**before, **changes} | {key: _changed(before[key], changes[key]) for key in blocks}


def _objects_in(raw: str) -> set[str]:
    folder = Path(raw)
    names = folder.iterdir() if folder.is_dir() else ()
    return {
        path.name
        for path in names
        if path.is_dir() and not path.name.startswith(".") and path.name not in NOT_OBJECTS
    }


def _nothing_found(paths: Mapping, only: str | None, known: set[str]) -> str:
    if only is not None:
        names = ", ".join(sorted(known)) or "none there"
        return f"only: expected an object of {paths['raw']}/ or of the lab ({names}), found {only}"
    return f"{paths['raw']}: expected captures (<object>/<sensor>/<capture>/), found none"
