"""The command ``palpate direct``: E and nu of captures."""

import argparse
import hashlib
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.capture.capture import Capture
from palpate.capture.devices import PLACES, add_devices
from palpate.commands.found import Project, captures_of, opened
from palpate.commands.help import add_verb, check_figure
from palpate.solid.options import LARGEST_RATIO

if TYPE_CHECKING:
    from palpate.estimate.direct.estimate import DirectEstimate
    from palpate.measurement import Measurement
    from palpate.solid.indentation_table import IndentationModel

ABOUT = """\
Estimate E and nu of captures: of one, of all of a sensor's folder, or of all of an object's, those
of one sensor together. Configuration, optics, solid and indentation tables are those of the
project's folder above, and a table that is made now is kept where a run keeps it.
"""
EXAMPLE = "palpate direct raw/sponge --fast"
# Of --fast: a table in a tenth of the time, and what it may be off by.
FAST = {"poisson_ratios": (0.0, 0.3, 0.49), "step_m": 0.003, "edge_m": 0.004}
FAST_STD = {"log_youngs_modulus": 0.05, "nu": 0.03}
FAST_NOTE = "coarse indentation table (--fast): 5 % of E and 0.03 of nu are allowed for it"


def _direct(options: argparse.Namespace) -> int:
    """E and nu, by object and sensor."""
    check_figure(options.figure)
    _check_files(options)
    captures = opened(
        captures_of(options.folders), {name: getattr(options, name) for name in PLACES}
    )
    points = {(one.folder.parents[1], one.point) for one in captures}
    groups: dict[Path, list[Capture]] = {}
    for capture in captures:
        groups.setdefault(capture.folder.parent, []).append(capture)
    steps = _Steps(len(captures) + len(points) + len(groups))
    made: dict[tuple[Path, str], Any] = {}
    found, failed = [], 0
    for group in groups.values():
        try:
            found.append((group, _estimated(group, options, steps, made)))
        except ValueError as error:
            failed = 1
            print("\n".join(f"error: {line}" for line in str(error).splitlines()), file=sys.stderr)
    if not found:
        return failed
    found = list(_compared(found))
    if options.figure:
        _write_figure(options.figure, [(_title(group), one) for group, one in found])
    if options.json:
        told = [_told(group, one, options) for group, one in found]
        print(json.dumps(told if len(groups) > 1 else told[0], indent=2))
        return failed
    for group, one in found:
        print("\n".join(_lines(_title(group), one, options)))
    return failed


def _compared(
    found: Sequence[tuple[list[Capture], "DirectEstimate"]],
) -> Iterator[tuple[list[Capture], "DirectEstimate"]]:
    """Estimates with what those of the same object by other sensors say against them."""
    from palpate.estimate.direct.warnings import Estimated, exclusions
    from palpate.report.style import sensor_name

    objects: dict[Path, list] = {}
    for group, one in found:
        objects.setdefault(group[0].folder.parents[1], []).append((group, one))
    for mine in objects.values():
        told = []
        for group, one in mine:
            which = "all captures" if len(group) > 1 else f"capture {group[0].folder.name}"
            sensor = sensor_name(group[0].folder.parent.name)
            told.append(Estimated(f"{which} by {sensor}", one.moduli, joint=True))
        for (group, one), lines in zip(mine, exclusions(told), strict=True):
            yield group, one.beside(lines)


class _Steps:
    """One line for each step as it begins, with how many are left."""

    def __init__(self, count: int) -> None:
        self.count, self.done = count, 0

    def begin(self, text: str) -> None:
        self.done += 1
        print(f"[{self.done} of {self.count}] {text}", file=sys.stderr, flush=True)


def _check_files(options: argparse.Namespace) -> None:
    for name in ("solid", "optics", "config"):
        path = getattr(options, name)
        if path is not None and not path.is_file():
            raise ValueError(f"--{name}: expected a file, found nothing at {path}")
    if options.nu is not None and not 0 <= options.nu <= LARGEST_RATIO:
        raise ValueError(f"--nu: expected from 0 to {LARGEST_RATIO:g}, found {options.nu:g}")
    if options.nu_std is not None and not 0 < options.nu_std < inf:
        raise ValueError(f"--nu-std: expected a number above 0, found {options.nu_std:g}")
    if options.nu_std is not None and options.nu is None:
        raise ValueError("--nu-std: expected --nu beside it, found none")


def _title(group: Sequence[Capture]) -> str:
    folder = group[0].folder
    count = len(group)
    return f"{folder.parents[1].name}, {folder.parent.name}: {count} capture{'s' * (count > 1)}"


def _calibrated(capture: Capture, paths: Sequence[Path]) -> Capture:
    """A capture whose probe is as a run found it, where its file asks for that."""
    from palpate.vision.calibrated_probe import calibrated_probe

    return replace(capture, probe=calibrated_probe(capture.probe, paths))


def _estimated(
    group: Sequence[Capture], options: argparse.Namespace, steps: _Steps, made: dict
) -> "DirectEstimate":
    """Estimate of captures of one object with one sensor."""
    from palpate import direct
    from palpate.measurement import measure

    folder = group[0].folder
    project = Project.near(folder)
    config = project.config(options.config)
    optics = options.optics
    if optics is None and group[0].sensor.get("optics") == "calibration":
        optics = project.optics(folder.parent.name)
    calibrations = project.calibrations(folder.parent.name)
    measured = []
    for capture in group:
        shown = os.path.relpath(capture.folder)
        steps.begin(f"{shown}: masks, probe, forces, clouds, motion")
        try:
            measured.append(measure(_calibrated(capture, calibrations), config, optics=optics))
        except ValueError as error:
            line = str(error)
            raise ValueError(line if shown in line else f"{shown}: {line}") from None
    for one in measured:
        key = folder.parents[1], one.capture.point
        if key not in made:
            made[key] = _table(one, project, options, steps)
    tables = [made[folder.parents[1], one.capture.point] for one in measured]
    steps.begin(f"{_title(group)}: E and nu")
    return direct.estimate(measured, tables, _fit(config.direct.fit, options))


def _fit(fit: Any, options: argparse.Namespace) -> Any:
    """Options of the fit, with what a person says of nu and of the table."""
    changes: dict[str, Any] = {}
    if options.nu is not None:
        changes["poisson_ratio"] = options.nu
    if options.nu_std is not None:
        changes["poisson_ratio_std"] = options.nu_std
    if options.fast:
        changes["model_std"] = fit.model_std.changed(**FAST_STD)
    return fit.changed(**changes)


def _table(
    one: "Measurement", project: Project, options: argparse.Namespace, steps: _Steps
) -> "IndentationModel":
    """Indentation table of a pressed point: kept, or made and kept."""
    from palpate.measurement import indentation_table, solid_of
    from palpate.solid.indentation_table import load_indentation, save_indentation

    name, point, model = one.capture.declared["object"], one.capture.point, one.config.direct.model
    model = model.changed(**FAST) if options.fast else model
    kept = options.solid or project.solid(name)
    for path in _kept_tables(one, model, kept, project, options):
        if path.is_file():
            steps.begin(f"indentation table of point {point}: {os.path.relpath(path)}")
            return load_indentation(path)
    folder = options.tables or project.results(name)
    path = folder and folder / _table_name(one, model, kept)
    where = f", kept in {os.path.relpath(path)}" if path else ""
    steps.begin(f"indentation table of point {point}: made now, a minute or more{where}")
    table = indentation_table(one, solid_of(one, kept), model)
    if path:
        save_indentation(path, table)
    return table


def _kept_tables(
    one: "Measurement",
    model: Any,
    solid: Path | None,
    project: Project,
    options: argparse.Namespace,
) -> Iterator[Path]:
    """Places of a table that serves: of a folder that was named, of a run, made here before."""
    capture = one.capture
    of_run = f"indentation-{capture.point}.npz"
    if options.tables:
        yield options.tables / of_run
    folder = options.tables or project.results(capture.declared["object"])
    if folder is None:
        return
    yield folder / _table_name(one, model, solid)
    if options.fast or options.solid or options.config or options.tables:
        return
    # A run makes it anew where one of these has changed.
    sources = [capture.folder.parents[1] / "object.yaml", capture.template, project.config_file]
    sources += _code_of_tables()
    path = folder / of_run
    if path.is_file() and all(path.stat().st_mtime >= one.stat().st_mtime for one in sources):
        yield path


def _code_of_tables() -> list[Path]:
    """Modules that make a table."""
    from palpate import solid

    return sorted(Path(solid.__file__).parent.glob("*.py"))


def _table_name(one: "Measurement", model: Any, solid: Path | None) -> str:
    """Name of a table that says all that it is made of, the code too: any change makes another."""
    declared, point = one.capture.declared, one.capture.point
    of_object = {name: declared.get(name) for name in ("template", "support", "deepest_m")}
    made_of = [of_object, declared["points"][point], one.capture.radius_m, model.written()]
    digest = hashlib.sha256(json.dumps(made_of, sort_keys=True).encode())
    for path in filter(None, (one.capture.template, solid, *_code_of_tables())):
        digest.update(path.read_bytes())
    return f"indentation-{point}-{digest.hexdigest()[:8]}.npz"


def _told(group: Sequence[Capture], found: "DirectEstimate", options: argparse.Namespace) -> dict:
    """All that went in and came out."""
    told = {"captures": [os.path.relpath(one.folder) for one in group], "fast": options.fast}
    return told | found.to_dict() | {"options": found.options.written()}


def _lines(title: str, found: "DirectEstimate", options: argparse.Namespace) -> Iterator[str]:
    from palpate.estimate.direct.result import described_law

    yield title
    for name, interval in found.moduli.items():
        yield f"  {name.removesuffix('_pa')}: {interval}"
    at, largest = 1e3 * found.quantities.depth_m, found.budget.sources[0].name
    yield f"  95 % intervals; largest source of effective E*'s: {largest}"
    where = f"{at:.1f} mm deep and after 1 s"
    yield f"  to compare objects: effective E*, {where}; to compute with: E and nu"
    for which, law in described_law(found)["law"].items():
        text = f"{law['value']:+.2f} +- {law['std']:.2f}"
        yield f"  law of the {which}: {text} (0: neo-Hooke's, 1: Blatz and Ko's)"
    if options.fast:
        yield f"  {FAST_NOTE}"
    yield from (f"  doubtful: {line}" for line in found.warnings)


def _write_figure(path: Path, found: Sequence[tuple[str, "DirectEstimate"]]) -> None:
    from palpate.capture.files import whole_file
    from palpate.report.direct_figure import figure_of_estimates

    with whole_file(path) as part:
        figure_of_estimates(found).savefig(part)


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    verb = add_verb(
        commands, "direct", "E and nu of captures", _direct, about=ABOUT, example=EXAMPLE
    )
    verb.add_argument(
        "folders",
        type=Path,
        nargs="+",
        metavar="FOLDER",
        help="raw/<object>, raw/<object>/<sensor> or raw/<object>/<sensor>/<capture>",
    )
    verb.add_argument("--nu", type=float, help="Poisson's ratio, where it is known beforehand")
    verb.add_argument("--nu-std", type=float, metavar="STD", help="and how well (0.002)")
    verb.add_argument("--fast", action="store_true", help="a coarse table, in a tenth of the time")
    verb.add_argument("--figure", type=Path, help="draw press and surface (.png, .svg, .pdf)")
    verb.add_argument("--json", action="store_true", help="for programs")
    verb.add_argument("--config", type=Path, help="options of all steps; else config/config.yaml")
    verb.add_argument("--tables", type=Path, help="folder of tables; else results/<object>")
    verb.add_argument("--solid", type=Path, help="mesh of the object (VTU); else a kept one")
    verb.add_argument("--optics", type=Path, help="calibration.json; else that of a run")
    add_devices(verb)
