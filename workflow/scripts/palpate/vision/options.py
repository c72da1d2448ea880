"""Options of what is seen: foreground, poses, forces, clouds."""

from dataclasses import dataclass
from typing import Literal

from palpate.options import Options, block, option


@dataclass(frozen=True, kw_only=True)
class Background(Options):
    """Foreground against a model of the background (Section 4.2.1)."""

    false_positive_rate: float = option(
        0.002, "part of the background taken for foreground", above=0, below=1
    )
    alpha_low: float = option(
        0.55, "darkest shadow, as part of the background's level", above=0, below=1
    )
    alpha_high: float = option(1.25, "brightest highlight, as part of it", above=1)
    opening_px: int = option(3, "opening of the mask", least=1, most=301)
    closing_px: int = option(7, "closing of the mask", least=1, most=301)
    smallest_blob_px: int = option(400, "smaller pieces are no object", least=1)
    largest_shift_px: float = option(0.5, "of the camera between background and capture", above=0)


@dataclass(frozen=True, kw_only=True)
class SupportPlane(Options):
    """The table in the depth of the empty scene."""

    inlier_distance_m: float = option(0.004, "of points from the table's plane", above=0)


@dataclass(frozen=True, kw_only=True)
class PoseFilter(Options):
    """Filter of the probe's poses (Eq. 4.21)."""

    method: Literal["study", "smoother", "none"] = option(
        "smoother", "study: Eq. 4.21 as printed, which lags a moving tip by 2.7 frames"
    )
    measurement_std_m: float = option(0.0001, "of a pose", above=0, most=0.01)
    acceleration_std_m_s2: float = option(
        0.2,
        "of the probe; at 6 Hz the smoother then hardly does more than bridge gaps",
        least=1e-4,
        most=1e4,
    )


@dataclass(frozen=True, kw_only=True)
class ProbePose(Options):
    """The probe's pose in each frame (Section 4.2.2)."""

    refinement: Literal["photometric", "corners"] = option(
        "photometric", "of the marker's pose; corners: as the study does"
    )
    largest_gap_frames: int = option(2, "longest run of frames without marker", least=0)
    filter: PoseFilter = block(PoseFilter, "of the poses")


@dataclass(frozen=True, kw_only=True)
class Force(Options):
    """Forces at the frames' times (Section 4.1.3)."""

    bias_window_s: float = option(0.5, "of the record at rest, before the press", above=0, most=60)
    matching: Literal["nearest", "linear"] = option(
        "linear", "of force to frame; nearest: averaged 10:1 and nearest in time, as the study does"
    )
    linear_window_s: float = option(0.1, "of the line through the samples", above=0, most=1)
    largest_gap_s: float = option(0.02, "from a frame to the nearest sample", above=0)


@dataclass(frozen=True, kw_only=True)
class Clouds(Options):
    """The object's points in each frame."""

    lowest_m: float = option(
        0.004, "above the table; lower points are the table's", above=0, most=0.2
    )
    voxel_m: float = option(0.002, "one point in each", above=0, most=0.2)
    normal_neighbours: int = option(30, "points that a normal is fitted to", least=3, most=1000)
    outlier_neighbours: int = option(20, "points that an outlier is held to", least=1, most=1000)
    outlier_ratio: float = option(2.0, "their distance over the mean, in deviations", above=0)
    cluster_gap_m: float = option(
        0.010, "of pieces farther apart the one at the tip is the object", above=0, most=0.2
    )


@dataclass(frozen=True, kw_only=True)
class Stereo(Options):
    """Matching of a rectified pair, of a sensor's file (Section 4.1.2)."""

    baseline_m: float = option(..., "between the cameras", above=0, most=2)
    method: Literal["block", "semi_global"] = option(..., "block: as the study matches")
    subpixel: Literal["matcher", "least_squares"] = option(..., "of the disparity")
    window_px: int = option(..., "side of the window, odd", least=5, most=31)
    max_left_right_px: float = option(..., "between matches there and back", above=0, most=1000)
    speckle_size_px: int = option(..., "smaller surfaces are dropped", least=0)
    highlights: Literal["drop", "keep"] = option(..., "where one camera alone sees a reflection")
