"""How scripts that make one of several tables and figures write it."""

from collections.abc import Callable

from matplotlib.figure import Figure
from palpate.capture.files import whole_file
from palpate.study import style, tables
from pandas import DataFrame


def write_table(output: object, table: DataFrame, *, title: str) -> None:
    """Write a table as CSV and Markdown."""
    with whole_file(output.csv) as csv, whole_file(output.md) as md:
        tables.write(table, csv, md, title=title)


def draw(output: object, make: Callable[[], Figure]) -> None:
    """Draw what a function makes in the project's style, as PNG and SVG."""
    with style.journal():
        figure = make()
        with whole_file(output.png) as png, whole_file(output.svg) as svg:
            style.save(figure, png, svg)
