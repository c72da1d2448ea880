"""The command ``palpate export``: the material of an object, for programmes of finite elements."""

import argparse
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.capture.discover import CURVE
from palpate.capture.files import write_text
from palpate.commands.help import add_verb
from palpate.commands.project import Project
from palpate.report.material import Material, material_of, recommended_row
from palpate.report.material_cards import PROGRAMMES, UNITS

# Objects with results that are named where another was asked for.
MOST_NAMED = 12
ABOUT = """\
Write the material of an object as a programme of finite elements takes it: the recommended estimate
of a run, neo-Hookean, with its relaxation where the programme has that; intervals and what else has
to be known stand in the file's comment. An estimate that the captures do not tell is refused.
"""


def _export(options: argparse.Namespace) -> int:
    results = options.results or Project.near(Path()).results() or Path("results")
    material = _material(_folder(results, options.object), options.sensor)
    programme = PROGRAMMES[options.to]
    path = options.output or Path(f"{options.object}-material{programme.suffix}")
    text = programme.write(material, UNITS[options.unit])
    write_text(path, text)
    print(f"{path}: E = {material.youngs_modulus}; nu = {material.poisson_ratio}")
    return 0


def _folder(results: Path, name: str) -> Path:
    """Results of an object.

    Raises
    ------
    ValueError
        If there are none.
    """
    known = {path.parent.name: path.parent for path in results.glob("*/summary.csv")}
    if name in known:
        return known[name]
    several = sorted(known)[:MOST_NAMED]
    several += [f"{len(known) - MOST_NAMED} more"] * (len(known) > MOST_NAMED)
    if not several:
        raise ValueError(f"{results}: results: expected those of a run (snakemake), found none")
    raise ValueError(f"{results}: object: expected one of {', '.join(several)}, found {name}")


def _material(folder: Path, sensor: str | None) -> Material:
    """Material of an object's results.

    Raises
    ------
    ValueError
        If a run has not estimated it, or the estimate is none to compute with.
    """
    path = folder / "summary.csv"
    try:
        summary = pd.read_csv(path, dtype={"sensor": str, "capture": str, "point": str})
        row = recommended_row(summary, sensor)
        estimate = None if row["sensor"] == CURVE else folder / row["sensor"] / "direct.json"
    except KeyError as error:
        raise ValueError(f"{path}: columns: expected {error}, found none") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    try:
        return material_of(row, estimate)
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(str(estimate)) else f"{path}: {text}") from None


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    verb = add_verb(
        commands,
        "export",
        "the material of an object, for finite elements",
        _export,
        about=ABOUT,
        example="palpate export sponge --to febio --unit mm",
    )
    verb.add_argument("object", help="its name, like sponge")
    verb.add_argument("--to", required=True, choices=PROGRAMMES, help="the programme")
    verb.add_argument("--unit", choices=UNITS, default="m", help="of lengths: m (Pa) or mm (MPa)")
    verb.add_argument("--sensor", help="where several have an estimate; curve: of a curve")
    verb.add_argument("--output", type=Path, help="file; else <object>-material with its ending")
    verb.add_argument("--results", type=Path, help="folder of a run; else the project's")
