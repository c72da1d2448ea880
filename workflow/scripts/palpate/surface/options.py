"""Options of alignment and trackers."""

from collections.abc import Mapping
from typing import Literal

from palpate.config.model import Count, Model, Positive, constant, option


class AlignmentLimits(Model):
    """Beyond them an alignment is refused: twice what the Kinect's noise, or a hand, makes."""

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


class Registration(Model):
    """Non-rigid registration of a template with clouds (Eq. 4.25, Section 5.2.1).

    The study prints other values (config/thesis.yaml): with those the dent stays untracked.
    """

    w_data: Positive = constant(1, "weight of the data")
    w_sm: Positive = option(4, "first weight of the smoothness, halved in each iteration")
    w_sm_stop: Positive = option(1, "until it is below this")
    s_sm: Positive = option(1, "radius of the smoothness, in edges or their mean length")
    neighbourhood: Literal["rings", "geodesic"] = option(
        "rings", "geodesic: as printed; it oversmooths a locally refined mesh"
    )
    data_term: Literal["point", "plane"] = option(
        "plane",
        "distance along the normal of the data point, which leaves vertices free sideways; point:"
        " Eq. 4.25 as printed, which drags them",
    )
    data_points: Literal["nearest", "mean"] = option(
        "mean",
        "mean height of the captured points as far as the vertex's edges reach; nearest: as"
        " printed, with all of one point's noise",
    )
    rounds: Count = constant(1, "searches for nearest data points for each w_sm", ge=1)
    largest_distance_m: Positive = constant(0.012, "dr of Eq. 4.24")
    largest_normal_deg: float = constant(60, "between normals of a pair", gt=0, le=180)
    rotations: bool = option(
        False, "true: angles and axes of Eq. 4.23 too, which only drags vertices sideways"
    )
    coarsest_vertices: Count = option(2000, "of the hierarchy; 1000 as printed", ge=1)


class StudyRefinement(Model):
    """The template that is registered."""

    kind: Literal["study"] = option("study", "registration by smoothness")
    refine_radius_m: Positive = option(0.020, "of the template around the contact")
    refine_edge_m: float | None = option(0.0025, "null: the template as it is", gt=0)


class StudyTracking(Registration, StudyRefinement):
    """The study's tracker (Section 4.3) with its added points (Section 5.2).

    Examples
    --------
    >>> StudyTracking(w_sm=10).neighbourhood
    'rings'
    """

    completion: Literal["none", "fem"] = option("none", "fem: Algorithm 3")
    undeformed_points: bool = option(True, "of unseen parts that stay undeformed (Section 5.2.1)")
    indenter_points: Literal["none", "places", "cap", "hemisphere"] = option(
        "places", "of the vertices under the sphere; cap or hemisphere (printed): its points"
    )
    copies: Count = option(
        1, "of the cloud, turned about the support's normal (Section 5.2.2)", ge=1
    )


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


TRACKERS = {"study": StudyTracking, "elastic": ElasticTracking}


def tracking_options(written: Mapping) -> StudyTracking | ElasticTracking:
    """Options of a tracker, of the kind that they name."""
    return TRACKERS[written["kind"]].read(written)
