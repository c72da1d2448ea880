"""Errors of a rig that no capture determines: what they do to a capture, and what is stated."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.options import Rig
from palpate.units import GRAVITY_M_S2

# Where a deviation comes from: the options, the probe's file, a run's recordings, the captures.
CONFIGURED, STATED, CALIBRATED, OBSERVED = "configured", "stated", "calibrated", "observed"
# Of the variance of the contact's place what is the tip's, typed from a drawing: 0.5 of 1 mm. The
# rest is lenses, template and alignment, and each capture's own.
TIP_PART = 0.25
# Of the variance of the force's axes what poses of a hanging weight can't determine: crosstalk of
# two axes into each other is a turn by half of its difference, and half of its sum is none.
AXES_LEFT = 0.5


@dataclass(frozen=True)
class ProbeUncertainty:
    """Standard uncertainties of a probe's numbers; None where nothing is stated.

    Attributes
    ----------
    tip_covariance_m2 : (3, 3) array or None
        Of the tip in the target's frame [m^2].
    mass_std_kg : float or None
        Of the payload of the force sensor.
    axes_std_rad : float or None
        Of the force sensor's turn against the target.
    compliance_std_m_n : float or None
        Of the probe's compliance.
    tip, mass, axes, compliance : {"stated", "calibrated"}
        Where each comes from.
    """

    tip_covariance_m2: NDArray | None = None
    mass_std_kg: float | None = None
    axes_std_rad: float | None = None
    compliance_std_m_n: float | None = None
    tip: str = STATED
    mass: str = STATED
    axes: str = STATED
    compliance: str = STATED

    @staticmethod
    def of(probe: Mapping) -> "ProbeUncertainty":
        """Read a probe's file, with what calibrations determined where there are some."""

        def origin(said: str | None) -> str:
            """Of a part, as `palpate.vision.calibrated_probe` leaves it."""
            return CALIBRATED if said == CALIBRATED else STATED

        rows, load = probe.get("tip_covariance_m2"), probe.get("load", {})
        return ProbeUncertainty(
            tip_covariance_m2=None if rows is None else np.array(rows, dtype=float),
            mass_std_kg=load.get("mass_std_kg"),
            axes_std_rad=probe.get("axes_std_rad"),
            compliance_std_m_n=probe.get("compliance_std_m_n"),
            tip=origin(probe.get("tip")),
            mass=origin(load.get("origin")),
            axes=origin(probe.get("axes")),
            compliance=origin(probe.get("stiffness")),
        )

    def rig(self, options: Rig) -> Rig:
        """Deviations of the rig, those that are stated in place of the options'."""
        known = {}
        if self.axes_std_rad is not None:
            left = np.sqrt(AXES_LEFT) * options.force_axes_std_rad
            known["force_axes_std_rad"] = float(np.hypot(self.axes_std_rad, left))
        if self.compliance_std_m_n is not None:
            known["compliance_std_m_n"] = self.compliance_std_m_n
        return options.changed(**known)

    def tip_root_m(self, place_std_m: float) -> NDArray:
        """Root of the tip's covariance in the target's frame, (3, 3) [m].

        Where none is stated that of a typed tip, a part of the contact's place (`TIP_PART`).
        """
        if self.tip_covariance_m2 is None:
            return np.sqrt(TIP_PART) * place_std_m * np.eye(3)
        return np.linalg.cholesky(self.tip_covariance_m2)

    @property
    def origins(self) -> dict[str, str]:
        """Where the budget's sources come from that are not the options' alone."""
        stated = {
            "tip of the probe": (self.tip_covariance_m2, self.tip),
            "mass of the load": (self.mass_std_kg, self.mass),
            "axes of the force sensor": (self.axes_std_rad, f"{CONFIGURED}, {self.axes}"),
            "compliance of the probe": (self.compliance_std_m_n, self.compliance),
        }
        return {name: origin for name, (value, origin) in stated.items() if value is not None}


UNSTATED = ProbeUncertainty()


def turned_gravity(turns: NDArray, up: NDArray, direction: NDArray) -> NDArray:
    """By how much a weight of 1 kg is wrong along the indentation, (f,) [m/s^2].

    The payload is in the force sensor's offset, in the probe's pose then: its mass matters by how
    much the vertical turns in the probe's frame since.

    Parameters
    ----------
    turns : (f, 3, 3) array
        Of the probe's target; the first is that of the offset.
    up, direction : (3,) arrays
        Unit vectors in the same frame.
    """
    return GRAVITY_M_S2 * (turns @ turns[0].T @ up - up) @ direction


@dataclass(frozen=True)
class RigError:
    """An error of a rig.

    Attributes
    ----------
    source : str
    std : float
        Its standard uncertainty, in its unit.
    unit : str
    changed : callable
        Gives a capture as an error of so much would have made it.
    common : bool, optional
        Whether all captures have the same.
    """

    source: str
    std: float
    unit: str
    changed: Callable[[DirectIndentation, float], DirectIndentation]
    common: bool = True


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
    o, mass_std_kg = known.rig(options), known.mass_std_kg or 0.0

    def scaled(one: DirectIndentation, error: float) -> DirectIndentation:
        return replace(one, force_n=one.force_n * (1 + error))

    def more(one: DirectIndentation, error: NDArray | float) -> DirectIndentation:
        return replace(one, force_n=one.force_n + error)

    def drifting(one: DirectIndentation, error: float) -> DirectIndentation:
        """By so much from the beginning of the record to its end."""
        return more(one, error * ((one.time_s - one.time_s[0]) / np.ptp(one.time_s)))

    def longer(one: DirectIndentation, error: float) -> DirectIndentation:
        """Of the way; what the target's scale does to all places alike is the depth's offset."""
        depths = {name: getattr(one, name) * (1 + error) for name in ("depth_m", "tip_depth_m")}
        return replace(one, **depths)

    def compliant(one: DirectIndentation, error: float) -> DirectIndentation:
        """The probe's target goes down farther than its tip."""
        return replace(one, depth_m=one.depth_m - error * one.force_n[one.frames])

    def sideways(one: DirectIndentation, error: float) -> DirectIndentation:
        return more(one, error * one.sideways_n)

    def heavier(one: DirectIndentation, error: float) -> DirectIndentation:
        return more(one, error * one.turned_m_s2)

    def wider(one: DirectIndentation, error: float) -> DirectIndentation:
        return scaled(one, -error / (2 * radius_m))

    def curved(one: DirectIndentation, error: float) -> DirectIndentation:
        return scaled(one, error * radius_m / 2)

    return (
        RigError("scale of the force", o.force_scale_std, "1", scaled),
        RigError("zero of the force", o.force_zero_std_n, "N", more, common=False),
        RigError("drift of the force", o.force_drift_std_n, "N", drifting, common=False),
        RigError("axes of the force sensor", o.force_axes_std_rad, "rad", sideways),
        RigError("radius of the sphere", o.radius_std_m, "m", wider),
        RigError("curvature of the template", o.curvature_std_per_m, "1/m", curved),
        RigError("side of the board", o.board_scale_std, "1", longer),
        RigError("compliance of the probe", o.compliance_std_m_n, "m/N", compliant),
        RigError("mass of the load", mass_std_kg, "kg", heavier),
    )
