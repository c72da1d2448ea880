"""Options of what is seen: foreground, poses, forces, clouds."""

from typing import Literal

from palpate.config.model import Count, Length, Model, Positive, constant, option


class Background(Model):
    """Foreground against a model of the background (Section 4.2.1)."""

    false_positive_rate: float = option(
        0.002, "part of the background taken for foreground", gt=0, lt=1
    )
    alpha_low: float = option(0.55, "darkest shadow, as part of the background's level", gt=0, lt=1)
    alpha_high: float = option(1.25, "brightest highlight, as part of it", gt=1)
    smallest_blob_px: Count = option(400, "smaller pieces are no object", ge=1)
    largest_shift_px: Positive = option(0.5, "of the camera between background and capture")


class SupportPlane(Model):
    """The table in the depth of the empty scene."""

    inlier_distance_m: Positive = option(0.004, "of points from the table's plane")


class ProbePose(Model):
    """The probe's pose in each frame (Section 4.2.2)."""

    refinement: Literal["photometric", "corners"] = option(
        "photometric", "of the marker's pose; corners: as the study does"
    )
    largest_gap_frames: Count = option(2, "longest run of frames without marker", ge=0)


class Force(Model):
    """Forces at the frames' times (Section 4.1.3)."""

    bias_window_s: float = option(0.5, "of the record at rest, before the press", gt=0, le=60)
    matching: Literal["nearest", "linear"] = option(
        "linear", "of force to frame; nearest: averaged 10:1 and nearest in time, as the study does"
    )
    linear_window_s: float = constant(0.1, "of the line through the samples", gt=0, le=1)
    largest_gap_s: Positive = option(0.02, "from a frame to the nearest sample")


class Clouds(Model):
    """The object's points in each frame."""

    lowest_m: Length = option(0.004, "above the table; lower points are the table's")
    voxel_m: Length = option(0.002, "one point in each")
    normal_neighbours: int = constant(30, "points that a normal is fitted to", ge=3, le=1000)
    cluster_gap_m: Length = option(
        0.010, "of pieces farther apart the one at the tip is the object"
    )
