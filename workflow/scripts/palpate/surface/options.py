"""Options of alignment and tracking."""

from typing import Literal

from palpate.config.model import Model, Positive, constant, option


class AlignmentLimits(Model):
    """Beyond them alignments are rejected: twice what the Kinect's noise, or an operator, makes."""

    least_near: float = option(0.9, "part of the cloud within dr", ge=0, le=1)
    largest_rms_m: Positive = option(0.003, "of the cloud's distances from the template")
    largest_height_m: Positive = option(0.004, "of the support above or below the table")
    largest_tilt_deg: float = option(2, "of the support against the table", gt=0, le=180)
    largest_touch_m: Positive = option(0.010, "from the declared point to the contact")
    largest_gap_m: Positive = option(0.005, "of the sphere when the force begins")


class Aligning(Model):
    """Template on the first frame (Eq. 4.24)."""

    largest_distance_m: Positive = constant(0.012, "dr of Eq. 4.24")
    largest_normal_deg: float = constant(60, "between normals of a pair", gt=0, le=180)
    limits: AlignmentLimits = option(AlignmentLimits(), "of what is accepted")


class ElasticTracking(Model):
    """Registration with the elastic energy of the solid that carries the template.

    Examples
    --------
    >>> ElasticTracking(poisson_ratio=0.4).solid_growth
    0.45
    """

    kind: Literal["elastic"] = option("elastic", "registration by elasticity")
    refine_radius_m: Positive = option(0.020, "of template and solid around the contact")
    refine_edge_m: Positive = option(0.0025, "of the template")
    solid_edge_m: Positive = option(0.002, "longest edges of the solid at the contact")
    solid_growth: Positive = option(0.45, "or this part of the distance from it")
    poisson_ratio: float = option(
        0.3, "the prior; E only scales the weight, which the noise chooses", ge=0, le=0.49
    )
    largest_distance_m: Positive = constant(0.012, "of points that count")
    largest_normal_deg: float = constant(60, "of points that count", gt=0, le=180)
    misfit_reach_m: Positive = constant(0.040, "points within it of the contact tell the weight")
    points: bool = option(True, "false: contact, support and prior alone")
