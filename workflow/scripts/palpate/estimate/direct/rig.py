"""Errors of a rig that no capture determines: what they do to a capture, and what is stated."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.options import Rig

# Where a deviation comes from: the options, the probe's file, a run's recordings, the captures.
CONFIGURED, STATED, CALIBRATED, OBSERVED = "configured", "stated", "calibrated", "observed"
# Of the variance of the contact's place what is the tip's, typed from a drawing: 0.5 of 1 mm. The
# rest is lenses, template and alignment, and each capture's own.
TIP_PART = 0.25


@dataclass(frozen=True)
class ProbeUncertainty:
    """Standard uncertainties of a probe's numbers; None where nothing is stated.

    Attributes
    ----------
    tip_covariance_m2 : (3, 3) array or None
        Of the tip in the target's frame [m^2].
    compliance_std_m_n : float or None
        Of the probe's compliance.
    tip, compliance : {"stated", "calibrated"}
        Where each comes from.
    """

    tip_covariance_m2: NDArray | None = None
    compliance_std_m_n: float | None = None
    tip: str = STATED
    compliance: str = STATED

    @staticmethod
    def of(probe: Mapping) -> "ProbeUncertainty":
        """Read a probe's file, with what calibrations determined where there are some."""

        def origin(said: str | None) -> str:
            """Of a part, as `palpate.vision.calibrated_probe` leaves it."""
            return CALIBRATED if said == CALIBRATED else STATED

        rows = probe.get("tip_covariance_m2")
        return ProbeUncertainty(
            tip_covariance_m2=None if rows is None else np.array(rows, dtype=float),
            compliance_std_m_n=probe.get("compliance_std_m_n"),
            tip=origin(probe.get("tip")),
            compliance=origin(probe.get("stiffness")),
        )

    def rig(self, options: Rig) -> Rig:
        """Deviations of the rig, those that are stated in place of the options'."""
        if self.compliance_std_m_n is None:
            return options
        return options.changed(compliance_std_m_n=self.compliance_std_m_n)

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
            "compliance of the probe": (self.compliance_std_m_n, self.compliance),
        }
        return {name: origin for name, (value, origin) in stated.items() if value is not None}


UNSTATED = ProbeUncertainty()


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
    o = known.rig(options)

    def scaled(one: DirectIndentation, error: float) -> DirectIndentation:
        return replace(one, force_n=one.force_n * (1 + error))

    def more(one: DirectIndentation, error: NDArray | float) -> DirectIndentation:
        return replace(one, force_n=one.force_n + error)

    def drifting(one: DirectIndentation, error: float) -> DirectIndentation:
        """By so much from the beginning of the record to its end."""
        return more(one, error * ((one.time_s - one.time_s[0]) / np.ptp(one.time_s)))

    def compliant(one: DirectIndentation, error: float) -> DirectIndentation:
        """The probe's target goes down farther than its tip."""
        return replace(one, depth_m=one.depth_m - error * one.force_n[one.frames])

    def wider(one: DirectIndentation, error: float) -> DirectIndentation:
        return scaled(one, -error / (2 * radius_m))

    def curved(one: DirectIndentation, error: float) -> DirectIndentation:
        return scaled(one, error * radius_m / 2)

    return (
        RigError("scale of the force", o.force_scale_std, "1", scaled),
        RigError("zero of the force", o.force_zero_std_n, "N", more, common=False),
        RigError("drift of the force", o.force_drift_std_n, "N", drifting, common=False),
        RigError("radius of the sphere", o.radius_std_m, "m", wider),
        RigError("curvature of the template", o.curvature_std_per_m, "1/m", curved),
        RigError("compliance of the probe", o.compliance_std_m_n, "m/N", compliant),
    )
