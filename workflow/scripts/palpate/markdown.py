"""Tables in Markdown."""

from collections.abc import Iterable, Sequence


def rows_of(
    header: Sequence[str], rows: Iterable[Sequence[str]], *, left: int | None = None
) -> list[str]:
    """Lines of a table: ``left`` columns stand to the left, all by default, the others right."""
    ends = len(header) if left is None else left
    marks = ["---"] * ends + ["---:"] * (len(header) - ends)
    return [_line(header), "|" + "|".join(marks) + "|", *(_line(row) for row in rows)]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
