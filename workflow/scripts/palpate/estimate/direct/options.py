"""Options of the direct estimate."""

from typing import Annotated

import numpy as np
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
