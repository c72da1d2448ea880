"""What a probe's numbers are worth where its file says it, in place of what any rig's are."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.options import Rig
from palpate.units import GRAVITY_M_S2

# Where a deviation comes from: the options, the probe's file, a run's films, the captures.
CONFIGURED, STATED, CALIBRATED, OBSERVED = "configured", "stated", "calibrated", "observed"
# Of the variance of the contact's place what is the tip's, typed from a drawing: 0.5 of 1 mm. The
# rest is lenses, template and alignment, and each capture's own.
TIP_PART = 0.25
# Of the variance of the force's axes what poses of a hanging weight can't tell: crosstalk of two
# axes into each other is a turn by half of its difference, and half of its sum is none.
AXES_LEFT = 0.5


@dataclass(frozen=True)
class ProbeUncertainty:
    """Standard uncertainties of a probe's numbers; None where nothing is stated.

    Attributes
    ----------
    tip_covariance_m2 : (3, 3) array or None
        Of the tip in the board's frame [m^2].
    mass_std_kg : float or None
        Of what hangs on the force sensor.
    axes_std_rad : float or None
        Of the force sensor's turn against the board.
    compliance_std_m_n : float or None
        Of what the probe gives way by.
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
        """Read a probe's file, with what calibrations told where there are some."""
        rows, load = probe.get("tip_covariance_m2"), probe.get("load", {})
        return ProbeUncertainty(
            tip_covariance_m2=None if rows is None else np.array(rows, dtype=float),
            mass_std_kg=load.get("mass_std_kg"),
            axes_std_rad=probe.get("axes_std_rad"),
            compliance_std_m_n=probe.get("compliance_std_m_n"),
            tip=_origin(probe.get("tip")),
            mass=_origin(load.get("origin")),
            axes=_origin(probe.get("axes")),
            compliance=_origin(probe.get("stiffness")),
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
        told = {
            "tip of the probe": (self.tip_covariance_m2, self.tip),
            "mass of the load": (self.mass_std_kg, self.mass),
            "axes of the force sensor": (self.axes_std_rad, f"{CONFIGURED}, {self.axes}"),
            "compliance of the probe": (self.compliance_std_m_n, self.compliance),
        }
        return {name: origin for name, (value, origin) in told.items() if value is not None}


def _origin(said: str | None) -> str:
    """Of a part, as `palpate.vision.calibrated_probe` leaves it."""
    return CALIBRATED if said == CALIBRATED else STATED


UNSTATED = ProbeUncertainty()


def turned_gravity(turns: NDArray, up: NDArray, press: NDArray) -> NDArray:
    """By how much a weight of 1 kg is wrong along the press, (f,) [m/s^2].

    What hangs on the force sensor is in its zero, in the probe's pose then: its mass matters by how
    much the vertical turns in the probe's frame since.

    Parameters
    ----------
    turns : (f, 3, 3) array
        Of the probe's board, camera frame; the first is that of the zero.
    up, press : (3,) arrays
        Unit vectors, camera frame.
    """
    return GRAVITY_M_S2 * (turns @ turns[0].T @ up - up) @ press
