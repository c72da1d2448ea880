"""The command ``palpate export``: the material of an object, for programmes of finite elements."""

import argparse
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.capture.discover import CURVE
from palpate.capture.files import write_text
from palpate.commands.help import add_verb
from palpate.commands.project import Project
from palpate.report.material import PROGRAMMES, UNITS, Material, material_of, recommended_row

# Objects with results that are named where another was asked for.
MOST_NAMED = 12
ABOUT = """\
Write the material of an object as a programme of finite elements takes it: the recommended estimate
of a run, neo-Hookean, with its relaxation where the programme has that; intervals and what else has
to be known stand in the file's comment. An estimate that the captures do not determine is rejected.
"""
EXAMPLE = "palpate export sponge --to febio --unit mm"


def _export(options: argparse.Namespace) -> int:
    results = options.results or Project.near(Path()).results() or Path("results")
    summaries = {path.parent.name: path for path in results.glob("*/summary.csv")}
    if not summaries:
        raise ValueError(f"{results}: results: expected those of a run (snakemake), found none")
    if options.object not in summaries:
        known = sorted(summaries)[:MOST_NAMED]
        known += [f"{len(summaries) - MOST_NAMED} more"] * (len(summaries) > MOST_NAMED)
        expected = f"expected one of {', '.join(known)}"
        raise ValueError(f"{results}: object: {expected}, found {options.object}")
    material = _material(summaries[options.object], options.sensor)
    programme = PROGRAMMES[options.to]
    path = options.output or Path(f"{options.object}-material{programme.suffix}")
    write_text(path, programme.write(material, UNITS[options.unit]))
    print(f"{path}: E = {material.youngs_modulus}; nu = {material.poisson_ratio}")
    return 0


def _material(path: Path, sensor: str | None) -> Material:
    """Material of a summary's recommended row; what is wrong names its file."""
    estimate = None
    try:
        summary = pd.read_csv(path, dtype={"sensor": str, "capture": str, "point": str})
        row = recommended_row(summary, sensor)
        if row["sensor"] != CURVE:
            estimate = path.parent / row["sensor"] / "direct.json"
        return material_of(row, estimate)
    except KeyError as error:
        raise ValueError(f"{path}: columns: expected {error}, found none") from None
    except ValueError as error:
        of_estimate = estimate and str(error).startswith(str(estimate))
        raise ValueError(f"{error}" if of_estimate else f"{path}: {error}") from None


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    short = "the material of an object, for finite elements"
    verb = add_verb(commands, "export", short, _export, about=ABOUT, example=EXAMPLE)
    verb.add_argument("object", help="its name, like sponge")
    verb.add_argument("--to", required=True, choices=PROGRAMMES, help="the programme")
    verb.add_argument("--unit", choices=UNITS, default="m", help="of lengths: m (Pa) or mm (MPa)")
    verb.add_argument("--sensor", help="where several have an estimate; curve: of a curve")
    verb.add_argument("--output", type=Path, help="file; else <object>-material with its ending")
    verb.add_argument("--results", type=Path, help="folder of a run; else the project's")
