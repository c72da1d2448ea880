"""The file of a depth sensor: ``config/sensors/<sensor>.yaml``."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field

from palpate.config.model import FILL_IN, FileName, Model, Vector, option, short, where, with_others

# Eq. 4.12 as printed is a rotation to 1e-8; files may be rounded further.
ROTATION_TOLERANCE = 1e-4
# Parts of one probe, or of one sensor, are nearer to each other; a tracker or a robot's base may
# stand across the room from a camera [m].
LONGEST_SHIFT_M, FARTHEST_BASE_M = 2.0, 10.0
# Of numbers that were rounded to four digits.
SYMMETRY_TOLERANCE = 1e-3
# A tip that is known worse is not [m], nor is a base [rad, m].
LARGEST_TIP_STD_M, LARGEST_BASE_STD = 0.02, 0.1
CALIBRATION, HAND_EYE = "calibration", "hand_eye"


def rigid_fault(rows: Sequence, longest_m: float = LONGEST_SHIFT_M) -> str:
    """Say what is wrong with a rigid transform, 4 x 4 numbers; empty where nothing is."""
    transform = np.array(rows, dtype=float)
    turn = transform[:3, :3]
    if not np.abs(transform[:3, 3]).max() <= longest_m:
        return f"a shift of {np.abs(transform[:3, 3]).max():g} m (metres?)"
    if not np.allclose(transform[3], [0, 0, 0, 1], atol=1e-9):
        return "another last row than 0, 0, 0, 1"
    if not np.allclose(turn @ turn.T, np.eye(3), atol=ROTATION_TOLERANCE):
        return "rows that are not square to each other and of length 1"
    return "" if np.linalg.det(turn) > 0 else "a mirrored one"


def covariance_fault(rows: Sequence, largest: float = LARGEST_TIP_STD_M, unit: str = "m") -> str:
    """Say what is wrong with a covariance, n x n numbers; empty where nothing is.

    ``largest`` is the largest deviation that is one, in ``unit``.
    """
    covariance = np.array(rows, dtype=float)
    alike = np.isclose(covariance, covariance.T, rtol=SYMMETRY_TOLERANCE, atol=0)
    for row, column in np.argwhere(~alike)[:1]:
        pair = f"{covariance[row, column]:.3g} and {covariance[column, row]:.3g}"
        return f"expected a symmetric matrix, found {pair} on two sides of its diagonal"
    least, *_, most = np.linalg.eigvalsh(covariance)
    if not least > 0:
        return f"expected variances above 0 in all directions, found {least:.3g}"
    if most > largest**2:
        found = f"{np.sqrt(most):.3g} {unit} (square metres?)"
        return f"expected deviations up to {largest:g} {unit}, found {found}"
    return ""


def rigid(longest_m: float) -> Any:
    """Type of rigid transforms, rows of 4 x 4 numbers, that shift no farther."""
    fault = partial(rigid_fault, longest_m=longest_m)
    holds = where(lambda rows: not fault(rows), "a rotation and a shift", fault)
    return Annotated[tuple[(tuple[(float,) * 4],) * 4], holds]


def covariance_of(size: int, *bound: Any) -> Any:
    """Type of covariances, rows of numbers, with the bounds of `covariance_fault`."""

    def checked(rows: tuple) -> tuple:
        if fault := covariance_fault(rows, *bound):
            raise ValueError(fault)
        return rows

    return Annotated[tuple[(tuple[(float,) * size],) * size], AfterValidator(checked)]


PAIR = "{0[0]:g}, {0[1]:g}".format
Transform = rigid(LONGEST_SHIFT_M)
FrameName = Annotated[str, Field(min_length=1, max_length=100)]
ClockStd = Annotated[float, Field(gt=0, le=1)]
NO_TRANSFORM = [*([FILL_IN] * 4 for _ in range(3)), [0, 0, 0, 1]]
Source = Literal["stated", "calibration"]
Side = Annotated[int, Field(ge=16, le=16384)]
Focal = Annotated[float, Field(ge=10, le=1e5)]
Coefficient = Annotated[float, Field(ge=-100, le=100)]
# Numbers of coefficients of OpenCV's lenses.
COEFFICIENTS = (4, 5, 8, 12, 14)
Distortion = Annotated[
    tuple[Coefficient, ...],
    where(lambda found: len(found) in COEFFICIENTS, "4, 5, 8, 12 or 14 numbers", len),
]
Distance = Annotated[float, Field(gt=0, le=50)]
BASELINE = {"gt": 0, "le": 2}
INCREASING = where(lambda ends: ends[0] < ends[1], "increasing distances", PAIR)
Shift = Annotated[float, Field(ge=-200, le=200)]
Window = Annotated[int, Field(ge=5, le=31), where(lambda count: count % 2, "an odd number")]
NOT_ZERO = where(bool, "another number than 0")
COUNTED = with_others("encoding", "counts")
KINECT = with_others("encoding", "kinect_disparity", only=False)
DEPTH = with_others("kind", "structured_light", "depth", only=False)
STEREO = with_others("kind", "stereo", only=False)
# What a sensor of kind cloud has in place of all of these.
PICTURES = with_others("kind", "stereo", "structured_light", "depth", only=False)
OF_PICTURES = ("optics", "color", "depth", "stereo", "marker")
CLOUD = with_others("kind", "cloud")
FOCAL = "the focal length [px], of the maker's tool or a calibration"
CENTRE = "the principal point [px], of the maker's tool or a calibration"


class CameraSpec(Model, use_attribute_docstrings=True):
    """A camera's images and optics."""

    width_px: Side = option(..., "the images' width [px]")
    height_px: Side = option(..., "the images' height [px]")
    encoding: str
    fx_px: Focal = option(..., FOCAL)
    fy_px: Focal = option(..., FOCAL)
    cx_px: float = option(..., CENTRE)
    cy_px: float = option(..., CENTRE)
    distortion: Distortion = option(examples=[[FILL_IN] * 5])
    """k1, k2, p1, p2, k3 or up to 14 in OpenCV's order, of a calibration; zeros if rectified"""

    def conflicts(self) -> Iterator[tuple]:
        """Principal points that are not within the image."""
        for name, side in (("cx_px", self.width_px), ("cy_px", self.height_px)):
            if not 0 <= (centre := getattr(self, name)) <= side:
                yield name, f"within the image, 0 to {side}", f"{centre:g}"


class ColorSpec(CameraSpec, use_attribute_docstrings=True):
    """The reference camera: colour, or left of a rectified pair."""

    encoding: Literal["rgb8", "mono8", "bayer_rggb8"] = option(examples=["rgb8"])
    """rgb8, mono8, or bayer_rggb8: the mosaic as the chip sees it"""


class DepthSpec(CameraSpec, use_attribute_docstrings=True):
    """The depth camera; where depth is aligned to colour its numbers are those of color."""

    encoding: Literal["kinect_disparity", "millimetre", "counts"]
    """millimetre, counts of count_m, or a Kinect's kinect_disparity"""
    count_m: float = COUNTED("what a count is [m], of encoding counts", ge=1e-6, le=0.01)
    baseline_m: float = KINECT(**BASELINE)
    """how far camera and projector are apart [m], of a calibration"""
    disparity_scale: float = KINECT(checks=[NOT_ZERO], ge=-10, le=10, examples=[-0.125])
    """pixels of disparity in a count (Eq. 4.2)"""
    disparity_offset_px: float = KINECT(ge=-10_000, le=10_000)
    """the disparity of count 0 [px] (Eq. 4.2), of a calibration"""
    infrared_shift_px: tuple[Shift, Shift] = None
    """of the depth image in the infrared's [px], right and down; Xbox 360 drivers: 5, 4"""
    no_reading: int = KINECT("the count where nothing was seen", examples=[2047], ge=0, le=65_535)
    color_from_depth: Transform = option(
        ...,
        "from the depth camera's frame to the colour camera's [m], of the maker's tool; rows"
        " 1 0 0 0, 0 1 0 0, 0 0 1 0 where depth is aligned to colour",
        examples=[NO_TRANSFORM],
    )


class StereoSpec(Model, use_attribute_docstrings=True):
    """Matching of the rectified pair."""

    baseline_m: float = option(**BASELINE)
    """how far the two cameras are apart [m], of a calibration"""
    method: Literal["block", "semi_global"] = option(examples=["semi_global"])
    """block, or semi_global"""
    subpixel: Literal["matcher", "least_squares"] = option(examples=["least_squares"])
    """matcher, or least_squares: refined by the images"""
    window_px: Window = option(..., "the matching window's side, odd [px]", examples=[11])
    max_left_right_px: float = option(gt=0, le=1000, examples=[1.0])
    """how far matches there and back may be apart [px]"""
    speckle_size_px: int = option(ge=0, le=1_000_000, examples=[150])
    """smaller surfaces are dropped [px]"""
    highlights: Literal["drop", "keep"] = option(..., "drop, or keep", examples=["drop"])


class CloudSpec(Model, use_attribute_docstrings=True):
    """Clouds as files; their frame is the camera's."""

    unit: Literal["m", "mm"]
    """of the coordinates: m or mm"""
    viewpoint_m: Vector = (0.0, 0.0, 0.0)
    """where the camera stands in the clouds' frame; 0 0 0: z forward and y down, else z up"""


class DetectionSpec(Model, use_attribute_docstrings=True):
    """How the probe's target is found."""

    reprojection_threshold_px: float = option(ge=0.001, le=100, examples=[0.45])
    """how far a corner may be off its place [px]"""


class BaseSpec(Model, use_attribute_docstrings=True):
    """Where the base frame of probe_poses.csv is, a robot's or an optical tracker's."""

    name: FrameName = option(None, "the base frame, as probe_poses.csv names it, like base_link")
    camera_from_base: rigid(FARTHEST_BASE_M) | Literal["calibration"] = option(
        ...,
        "from the base frame to the reference camera's [m]; calibration: of"
        " raw/sensors/<sensor>/hand_eye",
        examples=[NO_TRANSFORM],
    )
    covariance: covariance_of(6, LARGEST_BASE_STD, "rad or m") = None
    """6 x 6, of a rotation vector applied in the camera's axes [rad] and the origin's place [m]"""
    clock_offset_std_s: ClockStd = option(
        0.05, "how well the poses' clock is the camera's [s], before an indentation determines it"
    )
    pose_std_m: float = option(0.0001, "of a pose's place, where std_m says nothing", gt=0, le=0.01)
    pose_std_rad: float = option(0.0005, "of a pose's turn [rad]", gt=0, le=0.1)

    def conflicts(self) -> Iterator[tuple]:
        """A deviation beside the calibration, which has its own."""
        if self.camera_from_base == CALIBRATION and self.covariance is not None:
            expected = f"none beside camera_from_base: calibration ({HAND_EYE}.json has it)"
            yield "covariance", expected, "one"


def asks_for_base(sensor: Mapping) -> bool:
    """Whether a sensor's file leaves it to a calibration where the base of poses is."""
    return sensor.get("base", {}).get("camera_from_base") == CALIBRATION


def said_of_base(sensor: Mapping, name: str) -> float:
    """A number of a sensor's block ``base``, or what it is of a sensor without one."""
    return sensor.get("base", {}).get(name, BaseSpec.model_fields[name].default)


class SensorSpec(Model, use_attribute_docstrings=True):
    """A depth sensor."""

    sensor: FileName = option(..., "a name of small letters, digits and _, like d435")
    kind: Literal["stereo", "structured_light", "depth", "cloud"]
    """depth (RGB-D), structured_light (a Kinect's disparities), stereo or cloud (points)"""
    optics: Source = option("stated", "calibration: of raw/sensors/<sensor>/calibration")
    frame_rate_hz: float = option(..., "frames in a second, as the camera is set", gt=0, le=10_000)
    clock_offset_std_s: ClockStd = option(
        0.05,
        "how well its clock is the force's [s], before an indentation determines it: 0.05 for"
        " stamps at a picture's coming over USB, 0.01 where they allow for exposure and transfer",
    )
    range_m: Annotated[tuple[Distance, Distance], INCREASING]
    """nearest and farthest depth that you trust [m], of the maker's data sheet"""
    color: ColorSpec = PICTURES(ColorSpec.__doc__)
    depth: DepthSpec = DEPTH(DepthSpec.__doc__)
    stereo: StereoSpec = STEREO(StereoSpec.__doc__)
    marker: DetectionSpec = None
    base: BaseSpec = None
    cloud: CloudSpec = CLOUD(CloudSpec.__doc__)

    def conflicts(self) -> Iterator[tuple]:
        """Numbers of another kind of sensor, and nothing by which a probe is followed."""
        if self.marker is None and self.base is None:
            field, other = ("base", "") if self.kind == "cloud" else ("marker", "or base, ")
            yield field, f"a value ({other}of poses of a robot or a tracker)", "nothing"
        for name in OF_PICTURES if self.kind == "cloud" else ():
            if getattr(self, name) not in (None, "stated"):
                yield name, "none with kind cloud", "one"
        if self.kind == "cloud" and self.base and self.base.camera_from_base == CALIBRATION:
            yield "base.camera_from_base", "numbers with kind cloud (no pictures)", CALIBRATION
        if self.kind == "depth" and self.depth.encoding == "kinect_disparity":
            yield "depth.encoding", "one of counts, millimetre", short(self.depth.encoding)
        if self.kind == "stereo" and any(self.color.distortion):
            yield "color.distortion", "zeros (rectified)", list(self.color.distortion)
