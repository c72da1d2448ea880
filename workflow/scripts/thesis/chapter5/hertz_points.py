"""The Hertz fits of the block's points: Tables 5.1 and 5.2, Figures 5.3, A.1 and A.2."""

from typing import Any

import pandas as pd
from matplotlib.figure import Figure
from palpate.json_fields import read_all
from palpate.report import hertz_figures, hertz_tables, outputs, tables

REPEATED_TITLE = "Table 5.1: reduced modulus E* of repeated presses (Pa)"
POINTS_TITLE = "Table 5.2: reduced modulus E* from the Hertz fit (Pa)"
HOMOGENEOUS_NOTE = (
    "The virtual lab's block is homogeneous, and its edges make it at most 1 to 2 % softer: the"
    " published pattern of stiff centre and soft border cannot come from simulated captures."
)


def make_table_5_1(inputs: Any, params: Any) -> dict:
    """Reduced modulus of repeated presses of one point."""
    table = hertz_tables.table_5_1(_hertz(inputs, params), pd.read_csv(inputs.published))
    return outputs.table(tables.rounded(table), title=REPEATED_TITLE)


def make_table_5_2(inputs: Any, params: Any) -> dict:
    """Reduced modulus at the block's points, and its correlation with the published one."""
    published = pd.read_csv(inputs.published)
    table = hertz_tables.table_5_2(_hertz(inputs, params), published, block=params.block)
    table = tables.rounded(table)
    pattern = hertz_tables.pattern_correlation(table)
    both = outputs.table(table, title=POINTS_TITLE, more_notes=_notes(table, pattern))
    return both | {"pattern": pattern}


def make_figure_5_3(inputs: Any, params: Any) -> Figure:
    """Repeated recordings at one point, aligned at 0.3 N."""
    published = pd.read_csv(inputs.published)
    return hertz_figures.figure_5_3(params.captures, read_all(inputs.fits), published)


def make_figure_a(inputs: Any, params: Any) -> Figure:
    """Hertz fits at all points of the block, by one sensor."""
    return hertz_figures.figure_a(params.captures, read_all(inputs.fits))


def _hertz(inputs: Any, params: Any) -> pd.DataFrame:
    return hertz_tables.hertz_table(params.captures, read_all(inputs.fits))


def _notes(table: pd.DataFrame, pattern: pd.DataFrame) -> list[str]:
    """How far the pattern agrees with the published one, and why it need not."""
    found = pattern.dropna(subset=["pearson"])
    said = [
        f"{row.modulus}, {row.sensor}: {row.pearson:.2f} ({row.points} points)"
        for row in found.itertuples()
    ]
    lines = [f"Correlation with the published values: {'; '.join(said)}."] if said else []
    simulated = (table["provenance"] == "simulated").any()
    return lines + [HOMOGENEOUS_NOTE] * bool(simulated)
