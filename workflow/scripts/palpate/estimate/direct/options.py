"""Options of the direct estimate, and what is stated of a probe's own numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from palpate.config.model import (
    Length,
    Model,
    NotNegative,
    Positive,
    all_different,
    constant,
    option,
)
from palpate.vision.pose import by_turn

# Where a deviation comes from: the options, the probe's file, a run's recordings, the captures.
CONFIGURED, STATED, CALIBRATED, OBSERVED = "configured", "stated", "calibrated", "observed"
# Of the variance of the contact's place what is the tip's, typed from a drawing: 0.5 of 1 mm. The
# rest is lenses, template and alignment, and each capture's own.
TIP_PART = 0.25
# Of the camera in the base frame of poses from elsewhere, where nothing is stated [rad, m].
BASE_STD = (0.001, 0.001)
# Errors that all captures share, as the budget names them.
TIP_SOURCE, BASE_SOURCE = "place of the tip", "camera in the base frame"


class Observation(Model):
    """Motion of the surface's samples against the frames at rest."""

    spacing_m: Length = option(0.004, "of two samples' seeds")
    reach_m: Length = option(0.1, "of the farthest from the contact")
    largest_distance_m: Positive = constant(
        0.012, "points farther from the undeformed surface belong to something else"
    )
    largest_normal_deg: float = constant(
        60.0, "so do those whose normals are turned more against its own", gt=0, le=180
    )
    largest_view_deg: float = constant(
        60,
        "between line of sight and normal: at a silhouette windows hold what is behind",
        gt=0,
        le=90,
    )
    clear_m: NotNegative = option(
        0.018, "of lines of sight from the probe's axis: windows hold both nearer by"
    )
    shaft_clear_m: NotNegative = constant(0.045, "the same beside the handle")


class ModelStd(Model):
    """Deviations of the indentation table."""

    log_youngs_modulus: NotNegative = option(0.015, "of log E")
    nu: NotNegative = option(0.01, "of Poisson's ratio")
    nu_loose: NotNegative = constant(0.08, "the same where an object is not bonded to a broad base")
    sphere_friction: NotNegative = constant(
        0.006, "of log E, by friction at the sphere: up to 2 % more force than without"
    )


class Rig(Model):
    """Standard uncertainties of a rig that no press tells; what a careful lab reaches."""

    force_scale_std: NotNegative = option(0.01, "of the force sensor's scale")
    force_zero_std_n: NotNegative = option(0.003, "of what it reports unloaded")
    force_drift_std_n: NotNegative = option(0.01, "of that from a record's beginning to its end")
    radius_std_m: float = option(0.00002, "of the sphere's radius", ge=0, le=0.2)
    curvature_std_per_m: NotNegative = option(
        2.0, "of the template at the contact: 0.1 mm over 10 mm"
    )
    compliance_std_m_n: NotNegative = option(
        2e-6, "of what the probe gives way by between board and tip, beside its file's"
    )

    def modulus_std(self, *, force_n: float, depth_m: float, radius_m: float) -> float:
        """Relative standard deviation of E*, which goes with F R^(-1/2) d^(-3/2).

        Of a sphere of a radius [m] at the greatest force [N] and depth [m].
        """
        parts = (
            self.force_scale_std,
            float(np.hypot(self.force_zero_std_n, self.force_drift_std_n)) / force_n,
            self.radius_std_m / radius_m / 2,
            self.curvature_std_per_m * radius_m / 2,
            1.5 * self.compliance_std_m_n * force_n / depth_m,
        )
        return float(np.linalg.norm(parts))


@dataclass(frozen=True)
class ProbeUncertainty:
    """Standard uncertainties of a probe's numbers; None where nothing is stated.

    Attributes
    ----------
    tip_covariance_m2, compliance_std_m_n : (3, 3) array, float
        Of the tip in the target's frame [m^2], and of the probe's compliance.
    tip, compliance : {"stated", "calibrated"}
        Where each comes from.
    base : mapping or None
        Of the sensor's file, where poses come from elsewhere than its pictures.
    """

    tip_covariance_m2: NDArray | None = None
    compliance_std_m_n: float | None = None
    tip: str = STATED
    compliance: str = STATED
    base: Mapping | None = None

    @staticmethod
    def of(probe: Mapping, base: Mapping | None = None) -> "ProbeUncertainty":
        """Read a probe's file and the base of a sensor's, with what calibrations determined."""
        rows = probe.get("tip_covariance_m2")
        # As `palpate.vision.calibrated_probe` leaves them.
        tip, compliance = (
            CALIBRATED if probe.get(part) == CALIBRATED else STATED for part in ("tip", "stiffness")
        )
        return ProbeUncertainty(
            tip_covariance_m2=None if rows is None else np.array(rows, dtype=float),
            compliance_std_m_n=probe.get("compliance_std_m_n"),
            tip=tip,
            compliance=compliance,
            base=base,
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

    def base_root_m(self, place_m: NDArray) -> NDArray:
        """Root of the covariance of a place (3,) [m] in the camera frame, (3, 6) [m].

        By the base's, which is of a turn in the camera's axes and of the base frame's origin.
        """
        covariance = self.base.get("covariance") or np.diag(np.repeat(BASE_STD, 3) ** 2)
        lever_m = place_m - np.array(self.base["camera_from_base"], dtype=float)[:3, 3]
        return np.hstack([by_turn(lever_m), np.eye(3)]) @ np.linalg.cholesky(covariance)

    @property
    def origins(self) -> dict[str, str]:
        """Where the budget's sources come from that are not the options' alone."""
        base = self.base or {}
        stated = {
            TIP_SOURCE: (self.tip_covariance_m2, self.tip),
            BASE_SOURCE: (base.get("covariance"), base.get("origin", STATED)),
            "compliance of the probe": (self.compliance_std_m_n, self.compliance),
        }
        return {name: origin for name, (value, origin) in stated.items() if value is not None}


UNSTATED = ProbeUncertainty()


class Fit(Model):
    """What is compared, what is held likely of a rig, and how the answer is judged."""

    least_force_share: float = constant(
        0.05, "of the peak: frames with less are not compared", gt=0, lt=1
    )
    nearest_radii: NotNegative = constant(
        1.5, "samples nearer to the contact, in contact radii and metres, are left out"
    )
    nearest_m: NotNegative = constant(0.004, "the same in metres")
    farthest_m: Length = constant(0.1, "samples farther from it are left out")
    crease_m: NotNegative = constant(
        0.01, "nearer to a sharp edge of the object windows hold two sides of it"
    )
    patch_m: Length = constant(
        0.02, "of the surface; motions of different patches err independently"
    )
    relaxation_times_s: Annotated[tuple[Positive, ...], all_different] = option(
        (0.2, 1.0, 5.0), "of the Prony series", min_length=1
    )
    fraction_std: Positive = constant(0.07, "of the share that relaxes with each of them")
    fraction_step_std: Positive = constant(
        0.04, "of the difference between neighbouring times' shares"
    )
    gain_std: Positive = option(
        0.01, "of the camera's distances: a calibrated one's scale is known to a percent"
    )
    offset_std_m: Length = option(
        0.003, "of the depth, from tip and alignment: a press tells it better than they do"
    )
    depth_pattern_std_m: Length = constant(
        0.00003, "of the depth, of what hangs on where the probe is: no frames more tell more of it"
    )
    shift_std_m: Length = constant(0.00003, "of all motions in common")
    place_std_m: Length = constant(
        0.001, "of the contact's place along the surface, of camera against probe"
    )
    sinking_std_m: NotNegative = option(
        0.00001, "of what only stands: how far it goes down under the greatest force"
    )
    rocking_std_rad: NotNegative = option(
        0.0002, "and rocks on its base, beside the indentation table"
    )
    youngs_modulus_bounds_pa: tuple[Positive, Positive] = constant((100.0, 1e8), "of the fit")
    poisson_ratio_bounds: tuple[
        Annotated[float, Field(ge=0, le=0.4999)], Annotated[float, Field(ge=0, le=0.4999)]
    ] = option((0.0, 0.4999), "of the fit; the table's, and up to 0.01 beyond")
    poisson_ratio: float | None = option(
        None, "that is known beforehand; null where the press is to tell it", ge=0, le=0.4999
    )
    poisson_ratio_std: float = option(0.002, "of it, where it is known", gt=0, le=0.5)
    force_law_std: Positive = option(
        0.5, "of the place of the force's law between neo-Hooke's (0) and Blatz and Ko's (1)"
    )
    motion_law_std: Positive = option(1.0, "the same of the surface's motion")
    effective_depth_m: Length | None = option(
        None, "at which the effective modulus is stated; null: 0.7 of the maximum depth"
    )
    rig: Rig = option(Rig(), "of errors that are no unknowns of the fit")
    model_std: ModelStd = option(ModelStd(), "of the indentation table")
