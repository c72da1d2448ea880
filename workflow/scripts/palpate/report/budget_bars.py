"""Uncertainty budget of an estimate: shares of the variance, and what to improve next."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.options import CONFIGURED, OBSERVED
from palpate.modulus import LABELS
from palpate.report import texts
from palpate.units import PERCENT, readable

# Contributions that are shown, and what they are called.
SHOWN = {
    f"contribution_{'log_' * name.endswith('_pa')}{name.removesuffix('_pa')}": LABELS[name]
    for name in ("effective_reduced_modulus_pa", "youngs_modulus_pa", "poisson_ratio")
}
# Parts of a variance from which on a source has a bar, and advice.
LEAST_SHARE, LEAST_ADVISED = 0.02, 0.1
MOST_ADVICE = 4
# Units that take a prefix.
READABLE = ("m", "s", "N", "rad")


class Words(NamedTuple):
    """What to do about a source; of one without a unit also what its size is a part of."""

    advice: str
    of: str = ""


SOURCES = {name: Words(**said) for name, said in texts("sources").items()}


def bars(rows: Sequence[Mapping]) -> dict:
    """What a page shows of a budget (`Budget.rows`), as text and shares of the variance.

    Returns
    -------
    dict
        ``wholes``: name and standard uncertainty of each quantity that is shown; ``sources``, the
        largest first, each with ``name``, ``size`` and ``parts``, its share of each [%]; and
        ``advice``, what to do about the largest sources and for what.
    """
    shares = _shares(rows)
    most = shares.max(axis=0)
    order = np.argsort(-most, kind="stable")
    seen = [k for k in order if most[k] >= LEAST_SHARE]
    sources = [
        {"name": rows[k]["source"], "size": _size(rows[k]), "parts": shares[:, k]} for k in seen
    ]
    if len(seen) < len(rows):
        rest = 1 - shares[:, seen].sum(axis=1)
        sources.append({"name": "all others", "size": "", "parts": rest})
    for one in sources:
        one["parts"] = (PERCENT * one["parts"]).tolist()
    wholes = [(label, _whole(rows, name)) for name, label in SHOWN.items()]
    return {"wholes": wholes, "sources": sources, "advice": _advice(rows, shares, order)}


def largest(rows: Sequence[Mapping]) -> str:
    """One sentence with the largest source of each quantity's uncertainty, and its share."""
    of: dict[str, list[str]] = {}
    for label, shares in zip(SHOWN.values(), _shares(rows), strict=True):
        at = int(np.argmax(shares))
        of.setdefault(rows[at]["source"], []).append(f"{100 * shares[at]:.0f} % of {label}")
    told = ", ".join(f"{source} ({', '.join(parts)})" for source, parts in of.items())
    return f"Largest sources of uncertainty, by share of the variance: {told}."


def _shares(rows: Sequence[Mapping]) -> NDArray:
    """Parts of the variance of each quantity that is shown, by source (q, n)."""
    squares = np.array([[row[name] for row in rows] for name in SHOWN]) ** 2
    return squares / np.maximum(squares.sum(axis=1, keepdims=True), 1e-300)


def _whole(rows: Sequence[Mapping], name: str) -> str:
    """Standard uncertainty of a quantity by all sources."""
    std = float(np.sqrt(sum(row[name] ** 2 for row in rows)))
    return f"{std:.3f}" if name.endswith("ratio") else f"{PERCENT * std:.1f} %"


def _size(row: Mapping) -> str:
    """A standard uncertainty in the unit in which it is read best, or what it is a part of."""
    std, of = row["standard_uncertainty"], SOURCES[row["source"]].of
    origin = f", {row['origin']}" if row["origin"] not in (CONFIGURED, OBSERVED) else ""
    own, slash, per = row["unit"].partition("/")
    scale, unit = readable(std, own) if own in READABLE else (1.0, own.removeprefix("1"))
    if not unit + per:
        scale, unit = PERCENT if of.startswith("%") else 1.0, of
    # Two digits that count, without an exponent where there are few others.
    return f"±{float(f'{scale * std:.2g}'):g} {unit}{slash}{per}{origin}"


def _advice(rows: Sequence[Mapping], shares: NDArray, order: NDArray) -> dict[str, str]:
    """What to do about the largest sources, each sentence once, and for what."""
    found: dict[str, str] = {}
    for at in order:
        parts = zip(SHOWN.values(), shares[:, at], strict=True)
        helped = [label for label, part in parts if part >= LEAST_ADVISED]
        if len(found) == MOST_ADVICE or not helped:
            break
        source = rows[at]["source"]
        found.setdefault(SOURCES[source].advice, f"for {', '.join(helped)}: {source}")
    return found
