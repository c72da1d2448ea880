"""What makes an interval wide, as bars, and what to improve next in words."""

import re
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from palpate.estimate.direct.options import CONFIGURED, OBSERVED
from palpate.report.source_words import SOURCES
from palpate.units import readable

# Contributions that are shown, and what they are called.
SHOWN = {
    "contribution_log_effective_reduced_modulus": "effective E*",
    "contribution_log_youngs_modulus": "E at once",
    "contribution_poisson_ratio": "nu",
}
# Parts of a variance from which on a source has a bar, and advice.
LEAST_SHARE, LEAST_ADVISED = 0.02, 0.1
MOST_ADVICE = 4
# Units that take a prefix.
READABLE = ("m", "s", "N", "rad")
CODE = re.compile(r"`(.+?)`")


def bars(rows: Sequence[Mapping]) -> str:
    """Sources of a budget as bars, and advice for the largest.

    Parameters
    ----------
    rows : sequence of mapping
        Of `Budget.rows`.

    Returns
    -------
    str
        HTML. A bar is a source's share of the variance.
    """
    shares = {name: _shares(rows, name) for name in SHOWN}
    most = np.max(list(shares.values()), axis=0)
    order = np.argsort(-most, kind="stable")
    seen = [k for k in order if most[k] >= LEAST_SHARE]
    lines = [_legend(rows), '<ul class="budget">', _heads()]
    lines += [_source(rows[k], {name: part[k] for name, part in shares.items()}) for k in seen]
    if len(seen) < len(rows):
        rest = {name: 1 - sum(part[seen]) for name, part in shares.items()}
        lines.append(f'<li><b>all others</b><span class="size"></span>{_parts(rest)}</li>')
    return "\n".join([*lines, "</ul>", *_advice([rows[k] for k in order], shares, order)])


def largest(rows: Sequence[Mapping]) -> str:
    """One sentence with the largest source of each quantity's doubt, and its share.

    Parameters
    ----------
    rows : sequence of mapping
        Of `Budget.rows`.
    """
    of: dict[str, list[str]] = {}
    for quantity, label in SHOWN.items():
        shares = _shares(rows, quantity)
        at = int(np.argmax(shares))
        name = SOURCES[rows[at]["source"]].name
        of.setdefault(name, []).append(f"{100 * shares[at]:.0f} % of {label}")
    told = ", ".join(f"{source} ({', '.join(parts)})" for source, parts in of.items())
    return f"What limits it most, by its share of the variance: {told}."


def _shares(rows: Sequence[Mapping], name: str) -> np.ndarray:
    squares = np.array([row[name] for row in rows]) ** 2
    return squares / max(squares.sum(), 1e-300)


def _legend(rows: Sequence[Mapping]) -> str:
    """What the bars are parts of."""
    wholes = []
    for at, (name, label) in enumerate(SHOWN.items()):
        std = float(np.sqrt(sum(row[name] ** 2 for row in rows)))
        told = f"{std:.3f}" if name.endswith("ratio") else f"{100 * std:.1f} %"
        wholes.append(f'<span class="key q{at}">{label}: ±{told}</span>')
    return (
        f"<p>Standard uncertainty: {' '.join(wholes)}<br>A bar is a source's share of the"
        " variance, the square of that; the largest share of any comes first.</p>"
    )


def _heads() -> str:
    """Heads of the columns; on a narrow screen each bar has its own."""
    bars = "".join(f"<span>share of {label}</span>" for label in SHOWN.values())
    return f'<li class="heads"><span>source</span><span>known to</span>{bars}</li>'


def _source(row: Mapping, shares: Mapping[str, float]) -> str:
    words = SOURCES[row["source"]]
    size = _size(row["standard_uncertainty"], row["unit"], words.of)
    size += f", {row['origin']}" if row["origin"] not in (CONFIGURED, OBSERVED) else ""
    name = f'<b>{escape(words.name)}</b><span class="size">±{size}</span>'
    return f"<li>{name}{_parts(shares)}</li>"


def _parts(shares: Mapping[str, float]) -> str:
    """A bar for each quantity."""
    lines = []
    for at, (name, label) in enumerate(SHOWN.items()):
        part = 100 * float(shares[name])
        lines.append(
            f'<span class="bar"><span class="of">{label}</span><span class="track">'
            f'<span class="fill q{at}" style="width:{part:.1f}%"></span></span>'
            f'<span class="part">{part:.0f} %</span></span>'
        )
    return "".join(lines)


def _size(std: float, unit: str, of: str) -> str:
    """A standard uncertainty in the unit in which it is read best, or what it is a part of."""
    if unit == "1":
        return f"{100 * std if of.startswith('%') else std:.2g} {of}"
    own, _, per = unit.partition("/")
    scale, better = readable(std, own) if own in READABLE else (1.0, own.replace("1", ""))
    return f"{scale * std:.2g} {better}{f'/{per}' * bool(per)}"


def _advice(
    rows: Sequence[Mapping], shares: Mapping[str, np.ndarray], order: np.ndarray
) -> list[str]:
    """What to do about the largest sources and for what, each sentence once."""
    found: dict[str, str] = {}
    for row, at in zip(rows, order, strict=True):
        helped = [SHOWN[name] for name, part in shares.items() if part[at] >= LEAST_ADVISED]
        if len(found) == MOST_ADVICE or not helped:
            break
        words = SOURCES[row["source"]]
        found.setdefault(words.advice, f"for {', '.join(helped)}: {words.name}")
    items = [
        f"<li>{_with_code(escape(told, quote=False))} <i>({escape(of)})</i></li>"
        for told, of in found.items()
    ]
    return ["<h3>What to improve next</h3>", '<ol class="advice">', *items, "</ol>"]


def _with_code(html: str) -> str:
    return CODE.sub(r"<code>\1</code>", html)
