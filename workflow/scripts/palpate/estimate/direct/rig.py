"""Errors of a rig that are no unknowns of the fit: what each does to what a capture measures."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.options import Rig
from palpate.estimate.direct.probe_uncertainty import UNSTATED, ProbeUncertainty


@dataclass(frozen=True)
class RigError:
    """An error of a rig.

    Attributes
    ----------
    source : str
    std : float
        Its standard uncertainty, in its unit.
    unit : str
    common : bool
        Whether all captures have the same.
    changed : callable
        Gives a capture as an error of so much would have made it.
    """

    source: str
    std: float
    unit: str
    common: bool
    changed: Callable[[DirectIndentation, float], DirectIndentation]


def rig_errors(
    options: Rig, known: ProbeUncertainty = UNSTATED, *, radius_m: float
) -> tuple[RigError, ...]:
    """Errors of a rig with the standard uncertainties that are stated.

    In Hertz's contact the force at a depth goes with the root of the effective radius R, whose
    inverse is the sum of the sphere's and the surface's curvatures: -R/2 for a curvature.

    Parameters
    ----------
    options : Rig
    known : ProbeUncertainty, optional
        What is stated of the probe's own numbers.
    radius_m : float
        Of the sphere [m].
    """
    options = known.rig(options)
    return (
        RigError("scale of the force", options.force_scale_std, "1", True, _scaled_force),
        RigError("zero of the force", options.force_zero_std_n, "N", False, _more_force),
        RigError("drift of the force", options.force_drift_std_n, "N", False, _drifting_force),
        RigError(
            "axes of the force sensor",
            options.force_axes_std_rad,
            "rad",
            True,
            lambda one, error: _more_force(one, error * one.sideways_n),
        ),
        RigError(
            "radius of the sphere",
            options.radius_std_m,
            "m",
            True,
            lambda one, error: _scaled_force(one, -error / (2 * radius_m)),
        ),
        RigError(
            "curvature of the template",
            options.curvature_std_per_m,
            "1/m",
            True,
            lambda one, error: _scaled_force(one, error * radius_m / 2),
        ),
        RigError("side of the board", options.board_scale_std, "1", True, _scaled_depth),
        RigError("compliance of the probe", options.compliance_std_m_n, "m/N", True, _given_depth),
        RigError(
            "mass of the load",
            known.mass_std_kg or 0.0,
            "kg",
            True,
            lambda one, error: _more_force(one, error * one.turned_m_s2),
        ),
    )


def _scaled_force(one: DirectIndentation, error: float) -> DirectIndentation:
    return replace(one, force_n=one.force_n * (1 + error))


def _more_force(one: DirectIndentation, error: NDArray | float) -> DirectIndentation:
    return replace(one, force_n=one.force_n + error)


def _drifting_force(one: DirectIndentation, error: float) -> DirectIndentation:
    """By so much from the beginning of the record to its end."""
    part = (one.time_s - one.time_s[0]) / np.ptp(one.time_s)
    return _more_force(one, error * part)


def _scaled_depth(one: DirectIndentation, error: float) -> DirectIndentation:
    """Of the way; what the board's scale does to the place of all frames is the depth's zero."""
    part = 1 + error
    return replace(one, depth_m=one.depth_m * part, speed_m_s=one.speed_m_s * part)


def _given_depth(one: DirectIndentation, error: float) -> DirectIndentation:
    """The probe gives way: its board goes down farther than its tip."""
    return replace(one, depth_m=one.depth_m - error * one.force_n[one.frames])
