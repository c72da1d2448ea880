"""The command ``palpate direct``: E and nu of captures."""

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.capture.capture import Capture, open_capture
from palpate.capture.check import check_twice
from palpate.capture.devices import add_devices
from palpate.capture.discover import sensor_folders
from palpate.capture.files import whole_file
from palpate.capture.tables import FRAMES
from palpate.commands.help import add_verb, check_figure, stage
from palpate.commands.project import Project
from palpate.solid.options import LARGEST_RATIO

if TYPE_CHECKING:
    from palpate.estimate.direct.estimate import DirectEstimate
    from palpate.measurement import Measurement
    from palpate.solid.indentation_table import IndentationModel

OBJECT = "object.yaml"
ABOUT = """\
Estimate E and nu of captures: of one, of all of a sensor's folder, or of all of an object's, those
of one sensor together. Configuration, optics, solid and indentation tables are those of the
project's folder above, and a table that is made now is kept where a run keeps it.
"""
EXAMPLE = "palpate direct raw/sponge"
LAWS = {"force": "q of the force", "motion": "m of the displacement"}


def _direct(options: argparse.Namespace) -> int:
    """E and nu, by object and sensor."""
    check_figure(options.figure)
    _check_options(options)
    groups: dict[Path, list[Capture]] = {}
    for capture in (captures := _opened(_captures_of(options.folders), options)):
        groups.setdefault(capture.folder.parent, []).append(capture)
    points = {(one.folder.parents[1], one.point) for one in captures}
    steps = _Steps(options, len(captures) + len(points) + len(groups))
    found, failed = [], 0
    for group in groups.values():
        try:
            found.append((group, steps.estimate(group)))
        except ValueError as error:
            failed = 1
            print("\n".join(f"error: {line}" for line in str(error).splitlines()), file=sys.stderr)
    if not found:
        return failed
    found = list(_compared(found))
    if options.figure:
        from palpate.report.fitted_figures import figure_of_estimates

        with whole_file(options.figure) as part:
            figure_of_estimates([(_title(group), one) for group, one in found]).savefig(part)
    if not options.json:
        for group, one in found:
            print("\n".join(_lines(_title(group), one, options)))
        return failed
    fields = [
        {"captures": [os.path.relpath(capture.folder) for capture in group]}
        | one.to_dict()
        | {"options": one.options.written()}
        for group, one in found
    ]
    print(json.dumps(fields if len(groups) > 1 else fields[0], indent=2))
    return failed


def _check_options(options: argparse.Namespace) -> None:
    if options.config is not None and not options.config.is_file():
        raise ValueError(f"--config: expected a file, found nothing at {options.config}")
    if options.tables is not None and not options.tables.is_dir():
        found = f"none at {options.tables} (make it, or leave --tables out)"
        raise ValueError(f"--tables: expected a folder, found {found}")
    if options.nu is not None and not 0 <= options.nu <= LARGEST_RATIO:
        raise ValueError(f"--nu: expected from 0 to {LARGEST_RATIO:g}, found {options.nu:g}")
    if options.nu_std is not None and not 0 < options.nu_std < inf:
        raise ValueError(f"--nu-std: expected a number above 0, found {options.nu_std:g}")
    if options.nu_std is not None and options.nu is None:
        raise ValueError("--nu-std: expected --nu beside it, found none")


def _captures_of(given: Sequence[Path]) -> list[Path]:
    """Folders of captures in given ones: themselves, or those of a sensor or an object."""
    found: list[Path] = []
    for folder in given:
        path = Path(os.path.abspath(folder))
        subject = path if (path / OBJECT).is_file() else path.parent
        places = sensor_folders(subject) if (subject / OBJECT).is_file() else ()
        chosen = [place for place in places if path in (subject, place.folder)]
        inside = [one for place in chosen for one in place.captures]
        inside = [path] if (path / FRAMES).is_file() else inside
        if not inside:
            expected = "expected a capture, or an object's or a sensor's folder with captures"
            there = "none in it" if path.is_dir() else "no such folder"
            raise ValueError(f"{folder}: folder: {expected}, found {there}")
        found += [Path(os.path.relpath(one)) for one in inside]
    return list(dict.fromkeys(found))


def _opened(folders: Sequence[Path], options: argparse.Namespace) -> list[Capture]:
    """Open captures, none of them twice; what is wrong with any is one error."""
    captures, wrong = [], list(check_twice(folders))
    for folder in folders:
        try:
            captures.append(open_capture(folder, sensors=options.sensors, probes=options.probes))
        except ValueError as error:
            wrong += str(error).splitlines()
    if wrong:
        raise ValueError("\n".join(dict.fromkeys(wrong)))
    return captures


def _compared(
    found: Sequence[tuple[list[Capture], "DirectEstimate"]],
) -> Iterator[tuple[list[Capture], "DirectEstimate"]]:
    """Estimates with what those of the same object by other sensors say against them."""
    from palpate.estimate.direct.warnings import Estimated, exclusions
    from palpate.report.style import sensor_name

    objects: dict[Path, list] = {}
    for group, one in found:
        which = "all captures" if len(group) > 1 else f"capture {group[0].folder.name}"
        whose = f"{which} by {sensor_name(group[0].folder.parent.name)}"
        estimated = Estimated(whose, one.moduli, joint=True)
        objects.setdefault(group[0].folder.parents[1], []).append((group, one, estimated))
    for mine in objects.values():
        warnings = exclusions([estimated for *_, estimated in mine])
        for (group, one, _), lines in zip(mine, warnings, strict=True):
            yield group, one.beside(lines)


def _title(group: Sequence[Capture]) -> str:
    folder, count = group[0].folder, len(group)
    return f"{folder.parents[1].name}, {folder.parent.name}: {count} capture{'s' * (count > 1)}"


@dataclass
class _Steps:
    """Steps of all estimates: each says its number, and of how many."""

    options: argparse.Namespace
    count: int
    done: int = 0
    tables: dict[tuple[Path, str], "IndentationModel"] = field(default_factory=dict)

    def stage(self, text: str) -> Any:
        self.done += 1
        return stage(f"[{self.done} of {self.count}] {text}", lasting=True)

    def estimate(self, group: Sequence[Capture]) -> "DirectEstimate":
        """Estimate of captures of one object with one sensor."""
        from palpate import direct

        project, sensor = Project.near(group[0].folder), group[0].folder.parent.name
        config, made = project.config(self.options.config), group[0].sensor.get("optics")
        optics = project.optics(sensor) if made == "calibration" else None
        calibrations = project.calibrations(sensor)
        measured = [self._measure(capture, calibrations, config, optics) for capture in group]
        tables = [self._table(one, project) for one in measured]
        with self.stage(f"{_title(group)}: E and nu"):
            return direct.estimate(measured, tables, _fit(config.direct.fit, self.options))

    def _measure(
        self, capture: Capture, calibrations: Sequence[Path], config: Any, optics: Path | None
    ) -> "Measurement":
        """What a capture holds, its probe and its poses' base as a run found them where asked."""
        from palpate.measurement import measure
        from palpate.vision.calibrated_probe import calibrated_probe, placed_sensor

        shown = os.path.relpath(capture.folder)
        try:
            probe = calibrated_probe(capture.probe, calibrations)
            sensor = placed_sensor(capture.sensor, calibrations)
            capture = replace(capture, sensor=sensor, probe=probe)
            with self.stage(f"{shown}: masks, probe, forces, clouds, surface displacement"):
                return measure(capture, config, optics=optics)
        except ValueError as error:
            line = str(error)
            raise ValueError(line if shown in line else f"{shown}: {line}") from None

    def _table(self, one: "Measurement", project: Project) -> "IndentationModel":
        """Indentation table of a pressed point: kept, or made and kept."""
        from palpate.commands.tables import TablePoint

        capture, options = one.capture, self.options
        if (key := (capture.folder.parents[1], capture.point)) not in self.tables:
            of_object = key[0], capture.declared, capture.template, one.template, one.support
            point = TablePoint(*of_object, key[1], capture.radius_m, one.config.direct.model)
            how = {"changed": bool(options.config), "own": options.tables}
            self.tables[key] = point.table(project, self.stage, **how)
        return self.tables[key]


def _fit(fit: Any, options: argparse.Namespace) -> Any:
    """Options of the fit, with what a person says of nu."""
    given = {"poisson_ratio": options.nu, "poisson_ratio_std": options.nu_std}
    return fit.changed(**{name: value for name, value in given.items() if value is not None})


def _lines(title: str, found: "DirectEstimate", options: argparse.Namespace) -> Iterator[str]:
    from palpate.estimate.direct.result import described_law

    yield title
    for name, interval in found.moduli.items():
        yield f"  {name.removesuffix('_pa')}: {interval}"
    at, largest = 1e3 * found.quantities.depth_m, found.budget.sources[0].name
    yield f"  95 % intervals; what widens that of effective E* most: {largest}"
    where = f"{at:.1f} mm deep and after 1 s"
    yield f"  to compare objects: effective E*, {where}; to compute with: E and nu"
    for which, law in described_law(found.solution, found.quantities)["law"].items():
        text = f"{law['value']:+.2f} +- {law['std']:.2f}"
        yield f"  material law, {LAWS[which]}: {text} (0: neo-Hooke's, 1: Blatz and Ko's)"
    yield from (f"  warning: {line}" for line in found.warnings)


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    short = "E and nu of captures"
    verb = add_verb(commands, "direct", short, _direct, about=ABOUT, example=EXAMPLE)
    text = "raw/<object>, raw/<object>/<sensor> or raw/<object>/<sensor>/<capture>"
    verb.add_argument("folders", type=Path, nargs="+", metavar="FOLDER", help=text)
    verb.add_argument("--nu", type=float, help="Poisson's ratio, where it is known beforehand")
    verb.add_argument("--nu-std", type=float, metavar="STD", help="and how well (0.002)")
    verb.add_argument("--figure", type=Path, help="draw press and surface (.png, .svg, .pdf)")
    verb.add_argument("--json", action="store_true", help="for programs")
    verb.add_argument("--config", type=Path, help="options of all steps; else config/config.yaml")
    verb.add_argument("--tables", type=Path, help="folder of tables; else results/<object>")
    add_devices(verb)
