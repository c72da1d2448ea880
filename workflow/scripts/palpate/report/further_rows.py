"""What else follows from an estimate: G and K, later E, at which strain and pace."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from palpate.estimate.direct.quantities import ONE_SECOND_S
from palpate.modulus import Modulus
from palpate.report.held import Held
from palpate.report.own_words import WORDS
from palpate.units import MILLIMETRES

FURTHER = {
    "shear_modulus_pa": ("G", "E/(2 (1 + nu)): against shear"),
    "bulk_modulus_pa": ("K", "E/(3 (1 - 2 nu)): against squeezing from all sides"),
}
# Time after a step that this is of [s].
AFTER_S = {"youngs_modulus_1s_pa": ONE_SECOND_S}


def further(direct: Mapping, ends_s: float) -> Iterator[dict[str, str]]:
    """Rows of what follows from a direct.json, compared to a time after the touch [s]."""
    for name, (label, meaning) in FURTHER.items():
        modulus = Modulus(**direct[name])
        value, _, interval = modulus.told().partition(" (")
        # Without an upper end any value beyond the lower does as well.
        value = "" if modulus.high is None else value
        yield row(label, value, interval.rstrip(")"), sure(name, modulus, ends_s), meaning)


def sure(name: str, modulus: Modulus, ends_s: float) -> str:
    """How sure a modulus is; later than what was compared none is known."""
    if AFTER_S.get(name, 0.0) > ends_s:
        return f"extrapolated: the captures end at {ends_s:.1f} s"
    return WORDS.get(modulus.verdict, modulus.verdict)


def row(name: str, value: str, interval: str, sure: str, meaning: str) -> dict[str, str]:
    """Row of the table of moduli."""
    return {
        "": name,
        "value": value,
        "95 % interval": interval,
        "how sure": sure,
        "what it is": meaning,
    }


def conditions(direct: Mapping, held: Sequence[Held]) -> str:
    """At which strain and how fast these hold: at the depth of the effective modulus.

    Parameters
    ----------
    direct : mapping
        direct.json of all captures together.
    held : sequence of Held
        Those captures; of several the median is told.
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
