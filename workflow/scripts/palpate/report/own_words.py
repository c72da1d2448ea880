"""What an estimate says, in words for people who know nothing of the method."""

from collections.abc import Iterator, Mapping, Sequence
from statistics import NormalDist

import numpy as np
import pandas as pd

from palpate import modulus as verdicts
from palpate.capture.discover import CURVE
from palpate.estimate.direct.quantities import ONE_SECOND_S
from palpate.estimate.direct.warnings import FAR_LAW
from palpate.modulus import Modulus
from palpate.report.held import Held
from palpate.report.style import sensor_name
from palpate.units import MILLIMETRES

# Of the two laws that an estimate lies between (docs/how_it_works.md): place and name.
LAWS = {0.0: "neo-Hooke's", 1.0: "Blatz and Ko's"}
# A place that is known no better is what was held likely before (direct.fit.force_law_std).
LEAST_TOLD_STD = 0.4
# Verdicts as they are said of one modulus.
WORDS = {
    verdicts.IDENTIFIED: "known",
    verdicts.BOUNDED: "within limits",
    verdicts.NOT_IDENTIFIED: "not known",
    verdicts.INTERVAL: "interval given, not judged",
    verdicts.NOT_JUDGED: "no interval",
    verdicts.ASSUMED: "assumed",
}
RELIED_ON = (verdicts.IDENTIFIED, verdicts.INTERVAL)
OF_NU = {
    verdicts.IDENTIFIED: "Poisson's ratio is known",
    verdicts.BOUNDED: "Of Poisson's ratio only limits are known: trust the interval, not the value",
    verdicts.NOT_IDENTIFIED: "Poisson's ratio is not known: any value of its range explains the"
    " captures",
    verdicts.ASSUMED: "Poisson's ratio was assumed, not measured",
}
# What follows from the moduli.
FURTHER = {
    "shear_modulus_pa": ("G", "E/(2 (1 + nu)): against shear"),
    "bulk_modulus_pa": ("K", "E/(3 (1 - 2 nu)): against squeezing from all sides"),
}


def headline(row: Mapping, name: str) -> str:
    """One sentence, in Markdown, with what a recommended row of summary.csv says of an object."""
    parts = []
    if effective := Modulus.of_row(row, "effective_reduced_modulus_pa"):
        depth = row["effective_depth_m"] * MILLIMETRES
        parts.append(f"its effective E*, {depth:.1f} mm deep and after 1 s, is {_bold(effective)}")
    elif star := Modulus.of_row(row, "reduced_modulus_pa"):
        parts.append(f"its E* at small strain is {_bold(star)}")
    if young := Modulus.of_row(row, "youngs_modulus_pa"):
        parts.append(f"its Young's modulus E at once is {_bold(young)}")
    if nu := Modulus.of_row(row, "poisson_ratio"):
        parts.append(f"its Poisson's ratio nu is {_bold(nu)}")
    listed = ", ".join(parts[:-1]) + " and " * (len(parts) > 1) + parts[-1]
    return f"{name}, by {by(row)}: {listed}."


def by(row: Mapping) -> str:
    """What a row was recorded with."""
    count = row["captures"]
    counted = row["sensor"] != CURVE and not pd.isna(count)
    return device(row) + (f" and {count:.0f} capture{'s' * (count != 1)}" if counted else "")


def device(row: Mapping) -> str:
    """Sensor, or curve, of a row."""
    curve = row["sensor"] == CURVE
    return f"curve {row['capture']}" if curve else sensor_name(row["sensor"])


def verdict(row: Mapping) -> Iterator[str]:
    """Sentences on what of it is known."""
    nu = Modulus.of_row(row, "poisson_ratio")
    if nu and nu.verdict in OF_NU:
        yield f"{OF_NU[nu.verdict]}."
    if not pd.isna(row.get("force_law")):
        yield law(row["force_law"], row["force_law_std"])


def law(place: float, std: float) -> str:
    """What is known of how the force rises with depth.

    Of its place between the laws, 0 and 1, and that place's standard uncertainty.
    """
    half = NormalDist().inv_cdf((1 + verdicts.CONFIDENCE) / 2) * std
    untold = std > LEAST_TOLD_STD
    possible = [name for at, name in LAWS.items() if untold or abs(at - place) <= half]
    first, last = LAWS.values()
    interval = f"({place - half:.2f} to {place + half:.2f})"
    if len(possible) == len(LAWS):
        return (
            f"By which law the force rises with depth is not known: {first} and {last} both fit,"
            f" {place:.2f} of the way from one to the other {interval}. E at once carries that"
            " doubt, the effective E* hardly."
        )
    if not possible and abs(place) > FAR_LAW * std:
        return (
            f"The material-law parameter of the force is {place:.2f} {interval}, neither 0"
            f" ({first} law) nor 1 ({last}): a warning speaks against it."
        )
    where = "between" if 0 < place < 1 else "outside"
    told = f"by neither {first} nor {last} law but {where} the two: {place:.2f} of the way"
    if possible == [first]:
        told = f"near {first} law: {place:.2f} of the way to {last}"
    elif possible == [last]:
        told = f"near {last} law: {place:.2f} of the way from {first}"
    return f"The force rises with depth {told} {interval}."


def cells(
    key: str, modulus: Modulus | None, label: str, meaning: str, ends_s: float
) -> dict[str, str] | None:
    """Row of the table of moduli, of an estimate that was compared to a time after the touch [s].

    Of later times no modulus is known. None for a modulus without a verdict.
    """
    if not modulus or not modulus.verdict:
        return None
    value, _, interval = modulus.told().partition(" (")
    sure = WORDS.get(modulus.verdict, modulus.verdict)
    if key == "youngs_modulus_1s_pa" and ends_s < ONE_SECOND_S:
        sure = f"extrapolated: the captures end at {ends_s:.1f} s"
    # Of G and K without an upper end any value beyond the lower does as well.
    open_ended = key in FURTHER and modulus.high is None
    told = {"": label, "value": "" if open_ended else value, "95 % interval": interval.rstrip(")")}
    return told | {"how sure": sure, "what it is": meaning}


def conditions(direct: Mapping, held: Sequence[Held]) -> str:
    """At which strain and how fast these hold: at the depth of the effective modulus.

    Of the direct.json of all captures together, and those captures; of several the median is told.
    """
    strain, depth = 100 * direct["effective"]["strain"], direct["effective"]["depth_m"]
    there, deepest = (
        float(np.median([one.seconds_to(end) for one in held])) for end in (depth, np.inf)
    )
    rate = f" ({strain / there:.0f} % a second)" if there > 0 else ""
    return (
        f"The effective E* holds at a mean strain of {strain:.0f} %, {depth * MILLIMETRES:.1f} mm"
        f" deep, a second after a step; the tip was there {there:.1f} s after the touch{rate} and"
        f" deepest after {deepest:.1f} s. E at once, nu, G and K hold where strain goes to nothing,"
        " before it relaxes."
    )


def range_of(held: Sequence[Held]) -> str:
    """How E at once follows from the depths and times that were compared."""
    depths = np.concatenate([one.depth_m[one.frames] for one in held]) * MILLIMETRES
    return (
        "E at once is extrapolated to no strain and no time, from depths of"
        f" {depths.min():.1f} to {depths.max():.1f} mm and times to {compared_s(held):.1f} s."
    )


def compared_s(held: Sequence[Held]) -> float:
    """How long after the touch the longest of captures was compared [s]."""
    return max((one.compared_s for one in held), default=np.inf)


def _bold(modulus: Modulus) -> str:
    """Value and interval; in bold letters what is to be relied on."""
    value, _, interval = modulus.told().partition(" (")
    if modulus.verdict == verdicts.BOUNDED and interval:
        unit = value.partition(" ")[2]
        return f"within **{interval.rstrip(')')}{' ' * bool(unit)}{unit}** (likeliest {value})"
    bold = f"**{value}**" if modulus.verdict in RELIED_ON else value
    return bold + (f" ({interval}" if interval else "")
