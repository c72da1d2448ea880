"""What an estimate says, in words for people who know nothing of the method."""

from collections.abc import Iterator, Mapping, Sequence
from statistics import NormalDist

import numpy as np
import pandas as pd

from palpate import modulus as verdicts
from palpate.capture.discover import CURVE
from palpate.estimate.direct.quantities import ONE_SECOND_S
from palpate.estimate.direct.warnings import FAR_LAW
from palpate.modulus import LABELS, Modulus
from palpate.report import texts
from palpate.report.held import Held
from palpate.report.style import sensor_name
from palpate.report.tables import bound_mark
from palpate.units import MILLIMETRES

# The material laws that an estimate lies between (docs/how_it_works.md): parameter and name.
LAWS = {0.0: "neo-Hooke's", 1.0: "Blatz and Ko's"}
# A parameter that is known no better is as it was held likely before (direct.fit.force_law_std).
LEAST_KNOWN_STD = 0.4
EFFECTIVE = "effective_reduced_modulus_pa"
# Of Poisson's ratio by verdict; moduli that stand first, what each of all is, and what follows.
OF_NU, HEADLINES, MEANINGS, FURTHER = texts("moduli").values()


def by(row: Mapping) -> str:
    """What a row of summary.csv was recorded with."""
    count = row["captures"]
    counted = row["sensor"] != CURVE and not pd.isna(count)
    device = f"curve {row['capture']}" if row["sensor"] == CURVE else sensor_name(row["sensor"])
    return device + (f", {count:.0f} capture{'s' * (count != 1)}" if counted else "")


def cells(modulus: Modulus | None, row: Mapping | None = None) -> dict[str, str] | None:
    """Number to sort by, value, interval and verdict of a modulus as text; None stays None.

    Of a row whose search ended at a bound the value says so.
    """
    if modulus is None:
        return None
    value, _, interval = modulus.text().partition(" (")
    known = {"number": f"{modulus.value:.9g}", "value": value + bound_mark(row or {})}
    return known | {"interval": interval.rstrip(")"), "verdict": modulus.verdict}


def headlines(row: Mapping) -> Iterator[dict[str, str]]:
    """Moduli of a recommended row that stand first, with their names.

    E* at small strain is one of them where there is no effective one.
    """
    if pd.isna(row.get(EFFECTIVE)):
        star = cells(Modulus.of_row(row, "reduced_modulus_pa"))
        yield from [star | {"label": "E* at small strain"}] * (star is not None)
    for name, label in HEADLINES.items():
        if found := cells(Modulus.of_row(row, name)):
            yield found | {"label": label.format(MILLIMETRES * (row.get("effective_depth_m") or 0))}


def verdict(row: Mapping) -> Iterator[str]:
    """Sentences on what of a recommended row is identified."""
    nu = Modulus.of_row(row, "poisson_ratio")
    if nu and nu.verdict in OF_NU:
        yield f"{OF_NU[nu.verdict]}."
    if not pd.isna(row.get("force_law")):
        yield law(row["force_law"], row["force_law_std"])


def law(parameter: float, std: float) -> str:
    """What is known of the material-law parameter of the force, with its standard uncertainty."""
    half = NormalDist().inv_cdf((1 + verdicts.CONFIDENCE) / 2) * std
    unknown = std > LEAST_KNOWN_STD
    possible = [name for at, name in LAWS.items() if unknown or abs(at - parameter) <= half]
    first, last = LAWS.values()
    found = f"The material-law parameter of the force is {parameter:.2f}"
    found += f" ({parameter - half:.2f} to {parameter + half:.2f})"
    if len(possible) == len(LAWS):
        return (
            f"{found}: {first} law (0) and {last} (1) both explain the captures. The"
            " instantaneous E carries that uncertainty, the effective E* hardly."
        )
    if possible:
        return f"{found}: near {possible[0]} law (0: {first}, 1: {last})."
    where = f"neither 0 ({first} law) nor 1 ({last})"
    if abs(parameter) > FAR_LAW * std:
        return f"{found}, {where}: a warning speaks against it."
    return f"{found}, {where}: {'between' if 0 < parameter < 1 else 'outside'} the two."


def moduli(row: Mapping, direct: Mapping | None, ends_s: float) -> Iterator[dict[str, str]]:
    """Rows of the table of moduli of a recommended row, G and K of its direct.json among them.

    Of times later than the captures' comparison after the touch [s] no modulus is identified.
    """
    found = {key: (Modulus.of_row(row, key), LABELS[key], told) for key, told in MEANINGS.items()}
    if direct is not None:
        found |= {key: (Modulus(**direct[key]), *told) for key, told in FURTHER.items()}
    for key, (modulus, label, meaning) in found.items():
        if not (one := cells(modulus)) or not one["verdict"]:
            continue
        if key == "youngs_modulus_1s_pa" and ends_s < ONE_SECOND_S:
            one["verdict"] = f"extrapolated: the captures end at {ends_s:.1f} s"
        # Of G and K without an upper end any value beyond the lower does as well.
        open_ended = key in FURTHER and modulus.high is None
        yield {
            "modulus": label,
            "value": "" if open_ended else one["value"],
            "95 % interval": one["interval"],
            "verdict": one["verdict"],
            "what it is": meaning,
        }


def conditions(direct: Mapping, held: Sequence[Held]) -> str:
    """At which strain and how fast these hold: at the depth of the effective modulus.

    Of the direct.json of all captures together, and those captures; of several the median.
    """
    strain, depth = 100 * direct["effective"]["strain"], direct["effective"]["depth_m"]
    there, deepest = (
        float(np.median([one.seconds_to(end) for one in held])) for end in (depth, np.inf)
    )
    rate = f" ({strain / there:.0f} % per second)" if there > 0 else ""
    return (
        f"The effective E* holds at a mean strain of {strain:.0f} %, {depth * MILLIMETRES:.1f} mm"
        f" deep, 1 s after a step; the tip was there {there:.1f} s after the touch{rate} and at"
        f" maximum depth after {deepest:.1f} s. The instantaneous E, nu, G and K hold at small"
        " strain, before relaxation."
    )


def range_of(held: Sequence[Held]) -> str:
    """From which depths and times the instantaneous E is extrapolated."""
    depths = np.concatenate([one.depth_m[one.frames] for one in held]) * MILLIMETRES
    return (
        "Instantaneous E is extrapolated to small strain and no time, from depths of"
        f" {depths.min():.1f} to {depths.max():.1f} mm and times up to {compared_s(held):.1f} s."
    )


def compared_s(held: Sequence[Held]) -> float:
    """How long after the touch the longest of captures was compared [s]."""
    return max((one.compared_s for one in held), default=np.inf)
