"""Everything people write, read and checked once before the first job."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from palpate.capture.check import check_object
from palpate.capture.devices import PLACES, Devices, read_devices
from palpate.capture.discover import (
    CURVE,
    CaptureId,
    curve_files,
    discover,
    folders,
    object_folders,
    stamps_below,
)
from palpate.config.model import Model, problems
from palpate.workflow import configuration_checks as checks
from palpate.workflow.options import Config, as_asked
from palpate.workflow.places import placed, who_said
from palpate.workflow.run import Run
from palpate.yaml_files import load_yaml, one_line


def open_run(
    config: Mapping,
    *,
    sources: Sequence[str],
    project: Path,
    told: Mapping = MappingProxyType({}),
    files: bool = True,
    lab_kind: type[Model] | None = None,
    check_lab: Callable | None = None,
    kind: type[Config],
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
        False: jobs are to check tables and images of captures, and nothing is stamped.
    lab_kind, check_lab : type and callable, optional
        Model of a lab's configuration, and what else is wrong with it, as lines.
    kind : type
        Model of the configuration, which knows what a run with it is.
    rules : iterable, optional
        The workflow's rules.

    Raises
    ------
    ValueError
        With one line for each thing that is wrong.
    """
    source = sources[0]

    def require_none(lines: Iterable[str]) -> None:
        if lines := [one_line(who_said(line, sources, told)) for line in lines]:
            raise ValueError("\n".join(lines))

    config = _changed(config, as_asked(told, [kind]))
    require_none(problems(kind, config, source))
    config = kind.read(config).written()
    paths = config["paths"] = placed(config["paths"], project)
    raw, only = Path(paths["raw"]), config["only"]
    wrong = checks.path_problems(paths, source)
    lab = _lab(paths["lab"], lab_kind, wrong)
    devices = {kind: _devices(kind, paths[kind], wrong) for kind in PLACES}
    require_none([*wrong, *_wrong_devices(devices, checks.lab_devices(lab))])
    sensors, probes = (one.specs for one in devices.values())
    seen = stamps_below(raw, only=only) if files else {}

    wrong = list(check_lab(lab, sensors, paths["lab"])) if lab and check_lab else []
    dropped, objects = {one.name for one in object_folders(raw)}, (lab or {}).get("objects", {})
    there = checks.by_object(c for c in discover(raw) if only in (None, c.object))
    simulated = frozenset(
        capture
        for name, spec in objects.items()
        if only in (None, name) and checks.is_the_labs(name, raw, there[name], wrong)
        for capture in checks.lab_captures(name, spec, paths["lab"], sensors, probes, wrong)
    )
    made = checks.by_object(simulated)
    wrong += checks.dropped_among(made, there, paths)
    own = [name for name in sorted(dropped) if only in (None, name)]
    for name in own:
        # Passed over: a folder that the lab alone fills, or has still to complete.
        if not made[name] or made[name] < there[name]:
            wrong += check_object(raw / name, sensors, probes, files=files)
    filmed = config["experiments"]["probe"]
    experiments = (raw / "sensors").is_dir() or (lab or {}).get("experiments")
    wrong += checks.dropped_experiments(raw / "sensors", sensors, lab) if only is None else []
    if experiments and filmed and filmed not in probes:
        known = ", ".join(sorted(probes))
        wrong.append(f"{source}: experiments.probe: expected one of {known}, found {filmed}")
    curves = () if wrong else _curves(raw, [name for name in own if not made[name]])
    run = kind.run(
        config=config,
        sensors={name: spec for name, spec in sensors.items() if spec is not None},
        probes={name: spec for name, spec in probes.items() if spec is not None},
        lab=lab,
        found=tuple(sorted(simulated.union(*there.values()))),
        curves=curves,
        simulated=simulated,
        seen=seen,
        rules=rules,
    )
    wanted = run.captures
    names = {*dropped, *objects}
    wrong += run.problems(names, source)
    wrong += checks.missing_calibrations({c.sensor for c in wanted}, sensors, lab, paths)
    require_none(wrong or [_nothing_found(paths, only, names)] * (not wanted and not curves))
    used = {"sensors": {c.sensor for c in wanted}, "probes": {filmed} if experiments else set()}
    used["sensors"] |= {one.name for one in folders(raw / "sensors")} if only is None else set()
    recorded = {c.object for c in (*wanted, *curves) if not made[c.object]}
    used["probes"] |= {run.descriptions[name].get("probe") for name in recorded}
    require_none(_wrong_devices(devices, used))
    pressed = {(c.object, c.sensor): run.probe_spec(c) for c in wanted}
    require_none(checks.missing_films(pressed, lab, paths, filmed))
    return run


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


def _curves(raw: Path, names: Iterable[str]) -> tuple[CaptureId, ...]:
    """Curves of the objects that declare some."""
    return tuple(
        CaptureId(name, CURVE, path.stem)
        for name in names
        if (files := curve_files(raw / name)) and "curves" in load_yaml(raw / name / "object.yaml")
        for path in files
    )


def _lab(path: str | None, kind: type[Model] | None, wrong: list[str]) -> Mapping | None:
    """Content of a lab's file; None where there is none or it is wrong, which lines then say."""
    if path is None:
        return None
    try:
        spec = like_another(Path(path))
    except ValueError as error:
        wrong.append(str(error))
        return None
    wrong += (lines := problems(kind, spec, path) if kind else [])
    return None if lines else kind.plain(spec) if kind else spec


def like_another(path: Path) -> object:
    """Content of a file over that of the file that it is ``like``; a `ValueError` of either."""
    spec = load_yaml(path)
    if not isinstance(spec, Mapping) or not isinstance(spec.get("like"), str):
        return spec
    other = load_yaml(Path(name := spec.pop("like")))
    if not isinstance(other, Mapping):
        raise ValueError(f"{path}: like: expected a file with a mapping, found {other} in {name}")
    return _changed(other, spec)


def _changed(before: Mapping, changes: Mapping) -> dict:
    """Mapping with the changes of another, block by block; blocks that share an anchor part."""
    both = [k for k in before.keys() & changes.keys() if isinstance(changes[k], Mapping)]
    blocks = {k: _changed(before[k], changes[k]) for k in both if isinstance(before[k], Mapping)}
    return {**before, **changes, **blocks}


def _nothing_found(paths: Mapping, only: str | None, known: set[str]) -> str:
    if only is not None:
        names = ", ".join(sorted(known)) or "none there"
        return f"only: expected an object of {paths['raw']}/ or of the lab ({names}), found {only}"
    return f"{paths['raw']}: expected captures (<object>/<sensor>/<capture>/), found none"
