"""All objects of a run beside one another: a table that sorts, with E on one common axis."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape

from palpate.modulus import IDENTIFIED, Modulus
from palpate.report.own_words import WORDS, by, device
from palpate.report.table_page import BOX
from palpate.units import readable

YOUNG = "youngs_modulus_pa"
# Columns with a modulus, and their heads.
MODULI = {YOUNG: "E", "poisson_ratio": "nu", "effective_reduced_modulus_pa": "Effective E*"}
# From this many estimates on there is something to compare.
LEAST_ROWS = 2
# The axis: labels that have room on it, its steps within a decade, and its size on the screen [px].
MOST_TICKS, STEPS = 5, (1, 2, 5)
WIDTH, HEIGHT, MARGIN, END, DOT = 252, 22, 24, 4, 4
CAPTION = (
    "Recommended estimates with their 95 % intervals. Bars: E on one logarithmic axis; a hollow"
    " dot's value is not to be trusted, its bar is. A head's button sorts."
)


def section(rows: Sequence[Mapping], pages: Sequence[str] = ()) -> str:
    """Table of recommended rows of summary.csv, a line each, in HTML.

    Names of objects that have a page of their own lead to it. Where there are not two estimates to
    compare there are just the pages.
    """
    if len(rows) < LEAST_ROWS:
        return "".join(f"<p>Results of {_named(name, pages)}</p>" for name in pages)
    young = (Modulus.of_row(row, YOUNG) for row in rows)
    axis = ticks([one for one in young if one])
    count = Counter(row["object"] for row in rows)
    lines = [
        BOX.replace('aria-label="Table"', 'aria-label="All objects"'),
        '<table id="estimates">',
        f"<caption>{CAPTION}</caption>",
        f"<thead><tr>{_heads(axis)}</tr></thead>",
        "<tbody>",
        *(_line(row, axis, pages, apart=count[row["object"]] > 1) for row in rows),
        "</tbody></table></div>",
    ]
    return "\n".join(lines)


def ticks(found: Sequence[Modulus]) -> list[float]:
    """Round values on a logarithmic axis that holds all moduli and intervals, rising [Pa].

    The first and the last are the axis' ends. Steps of 1, 2 and 5, or decades, or several decades,
    whichever are few enough to be labelled. Nothing for no moduli.
    """
    ends = [end for one in found for end in (one.value, one.low, one.high) if end is not None]
    if not ends:
        return []
    low, high = min(ends), max(ends)
    first, last = math.floor(math.log10(low)), math.floor(math.log10(high)) + 1
    fine = [step * 10.0**power for power in range(first, last + 1) for step in STEPS]
    start = max(at for at, tick in enumerate(fine) if tick <= low)
    stop = min(at for at, tick in enumerate(fine) if tick >= high and at > start)
    if stop - start < MOST_TICKS:
        return fine[start : stop + 1]
    width = math.ceil((last - first) / (MOST_TICKS - 1))
    return [10.0**power for power in range(first, last + width, width)]


def _heads(axis: Sequence[float]) -> str:
    labels = ["Object", *MODULI.values(), "Recorded with"]
    heads = [f'<th scope="col"><button type="button">{label}</button></th>' for label in labels]
    if axis:
        words = [
            f'<text x="{_across(tick, axis):.1f}" y="14">{_tick(tick)}</text>' for tick in axis
        ]
        heads.insert(1, f'<th scope="col">E on one axis<br>{_drawn("".join(words))}</th>')
    return "".join(heads)


def _tick(value: float) -> str:
    scale, unit = readable(value, "Pa")
    return f"{scale * value:.3g} {unit}"


def _named(name: str, pages: Sequence[str]) -> str:
    """Name of an object, with a link to its page if it has one."""
    told = escape(_words(name))
    return f'<a href="{escape(name)}/report.html">{told}</a>' if name in pages else told


def _words(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _line(row: Mapping, axis: Sequence[float], pages: Sequence[str], *, apart: bool) -> str:
    """An estimate; its name says by which device where that tells it from others."""
    name, recorded = row["object"], escape(by(row))
    which = f'<br><span class="verdict">{escape(device(row))}</span>' if apart else ""
    head = f'<th scope="row" data-value="{escape(_words(name))}">{_named(name, pages)}{which}</th>'
    bar = f"<td>{_bar(Modulus.of_row(row, YOUNG), axis)}</td>" if axis else ""
    moduli = "".join(_cell(Modulus.of_row(row, column)) for column in MODULI)
    return f'<tr>{head}{bar}{moduli}<td data-value="{recorded}">{recorded}</td></tr>'


def _cell(modulus: Modulus | None) -> str:
    """Value, interval and verdict; what it is sorted by."""
    if modulus is None:
        return "<td></td>"
    word = WORDS.get(modulus.verdict, modulus.verdict)
    told = f'{modulus.told()}<br><span class="verdict">{escape(word)}</span>'
    return f'<td data-value="{modulus.value:.9g}">{told}</td>'


def _bar(modulus: Modulus | None, axis: Sequence[float]) -> str:
    """Interval and value on the axis, over the lines of its ticks; the numbers stand beside it."""
    lines = [f'<path class="tick" d="M{_across(tick, axis):.1f} 0v{HEIGHT}"/>' for tick in axis]
    if modulus is None:
        return _drawn("".join(lines))
    middle = HEIGHT / 2
    if modulus.low is not None and modulus.high is not None:
        low, high = (_across(end, axis) for end in (modulus.low, modulus.high))
        ends = "".join(f"M{end:.1f} {middle - END}v{2 * END}" for end in (low, high))
        lines.append(f'<path class="interval" d="M{low:.1f} {middle}H{high:.1f}{ends}"/>')
    kind = "dot" if modulus.verdict == IDENTIFIED else "dot hollow"
    place = f'cx="{_across(modulus.value, axis):.1f}" cy="{middle}" r="{DOT}"'
    return _drawn("".join([*lines, f'<circle class="{kind}" {place}/>']))


def _drawn(content: str) -> str:
    size = f'width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}"'
    return f'<svg {size} aria-hidden="true">{content}</svg>'


def _across(value: float, axis: Sequence[float]) -> float:
    """Place of a modulus on the axis [px]."""
    share = math.log(value / axis[0]) / math.log(axis[-1] / axis[0])
    return MARGIN + share * (WIDTH - 2 * MARGIN)
