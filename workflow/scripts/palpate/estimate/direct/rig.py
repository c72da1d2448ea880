"""What is stated of a probe's own numbers, and where the budget's deviations come from."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
