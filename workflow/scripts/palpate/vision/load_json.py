"""A load as load.json holds it, and what is said of it."""

from collections.abc import Iterator, Sequence
from math import hypot, radians, sqrt

import numpy as np

from palpate.units import MILLIMETRES, PERCENT
from palpate.vision.load import Load

# Standard deviations up to which a load is told: a hundredth of a newton, and what it takes for
# the direction of a press to be right to half a percent of its force.
MASS_KG, CENTRE_M, TURN_DEG = 0.001, 0.001, 0.3
# Of a channel's scale: what calibrations of a maker hold to, and standard deviations beyond it.
GAIN, SURE = 0.03, 5.0
# A table that a spirit level calls level is so to half a degree: a uniform distribution, 0.005 rad.
LEVEL_STD_RAD = radians(0.5) / sqrt(3)


def load_fields(found: Load, names: Sequence[str], probe: str | None) -> dict:
    """What load.json says, of a probe by its name where that is known."""
    return {
        "probe": probe,
        "mass_kg": found.mass_kg,
        "mass_std_kg": float(found.std[0]),
        "centre_of_mass_m": found.centre_of_mass_m.tolist(),
        "bias_n_nm": found.bias.tolist(),
        "marker_from_force_rotation": found.marker_from_force.tolist(),
        "axes_std_rad": axes_std_rad(found),
        "unknowns": ["mass_kg"]
        + [
            f"{name}_{axis}"
            for name in ("turn_rad", "bias_n", "centre_m", "bias_nm")
            for axis in "xyz"
        ],
        "covariance": found.covariance.tolist(),
        "poses": len(names),
        "left_out_n_nm": left_out(found, names),
        "verdict": list(verdict(found)),
    }


def left_out(found: Load, names: Sequence[str]) -> dict[str, list[float]]:
    """Poses that were left out, and by how much force and torque are off [N, Nm]."""
    return {
        names[k]: [float(np.linalg.norm(part)) for part in np.split(found.residuals[k], 2)]
        for k in np.flatnonzero(~found.kept)
    }


def axes_std_rad(found: Load) -> float:
    """Deviation of the sensor's turn [rad]: what poses tell, and the vertical, which none does.

    A vertical that is off stays so in the camera's frame; poses that turn about it take some of
    that back, which is not counted on.
    """
    return hypot(radians(found.turn_std_deg), LEVEL_STD_RAD)


def verdict(found: Load) -> Iterator[str]:
    """Whether the poses tell each part."""
    worst_m = float(found.std[7:10].max())
    for part, told, how in (
        ("mass", found.std[0] <= MASS_KG, f"{found.std[0] * 1e3:.2g} g"),
        ("centre of mass", worst_m <= CENTRE_M, f"{worst_m * MILLIMETRES:.2g} mm"),
        ("rotation", found.turn_std_deg <= TURN_DEG, f"{found.turn_std_deg:.2g} degrees"),
    ):
        more = "" if told else ": hold it longer, in more poses that differ more"
        yield f"{part}: {'' if told else 'not '}told, to {how}{more}"
    gains, std = found.gains
    apart, worst = gains - np.median(gains), int(np.argmax(np.abs(gains - np.median(gains))))
    if abs(apart[worst]) > max(GAIN, SURE * std[worst]):
        channel = ("fx", "fy", "fz")[worst]
        yield (
            f"doubtful: {channel} reads {PERCENT * apart[worst]:+.2g} % of the weight against the"
            " other forces: its scale, or that of its amplifier?"
        )
