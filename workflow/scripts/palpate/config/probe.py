"""The file of a force probe: ``config/probes/<probe>.yaml``."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from math import prod
from typing import Annotated, Literal

import numpy as np
from numpy.linalg import matrix_rank
from pydantic import Field

from palpate.config.model import FILL_IN, FileName, Model, option, where, with_others
from palpate.config.sensor import (
    CALIBRATION,
    NO_TRANSFORM,
    PAIR,
    FrameName,
    Source,
    Transform,
    covariance_of,
)

# OpenCV's families of tags: how many each has, and the cells along one with its border.
FAMILIES = {f"{n}X{n}_{k}": (k, n + 2) for n in (4, 5, 6, 7) for k in (50, 100, 250, 1000)}
FAMILIES |= {"APRILTAG_16H5": (30, 6), "APRILTAG_25H9": (35, 7), "APRILTAG_36H10": (2320, 8)}
FAMILIES |= {"APRILTAG_36H11": (587, 8), "ARUCO_MIP_36H12": (250, 8), "ARUCO_ORIGINAL": (1024, 7)}
# White about a tag that OpenCV asks for, in cells; and between tags, in tags.
LEAST_MARGIN, LEAST_GAP = 0.7, 0.1
FEWEST_CORNERS = 6
# What depth images blur around a tip [m].
TIP_MARGIN_M = 0.002
# Fields that may ask for a part's calibration, and those of what each is then known to.
DEVIATIONS = {
    "load": {"load": "load.mass_std_kg", "axes": "axes_std_rad"},
    "tip": {"tip": "tip_covariance_m2"},
    "stiffness": {"stiffness_n_m": "compliance_std_m_n"},
}

CHECKERBOARD, CHARUCO = with_others("kind", "checkerboard"), with_others("kind", "charuco")
SQUARED, TAGGED = (with_others("kind", one, "charuco") for one in ("checkerboard", "aprilgrid"))
APRILGRID = with_others("kind", "aprilgrid")
WHITE, TURNS = (with_others("kind", one, needed=False) for one in ("charuco", "aprilgrid"))
Few = Annotated[int, Field(ge=2, le=50)]
Corners = Annotated[int, Field(ge=3, le=50)]
# A board that is even or odd both ways looks the same from both ends.
ONE_ODD = where(lambda corners: sum(corners) % 2, "one odd and one even", PAIR)
SIDE = {"ge": 0.001, "le": 0.5}
Reach = Annotated[float, Field(gt=0, le=1)]
Metres = Annotated[float, Field(ge=-1, le=1)]
# A calibration of fewer leaves out a part of the wrench, whatever the gauges say.
Gauges = Annotated[
    tuple[(tuple[(float,) * 6],) * 6],
    where(lambda rows: matrix_rank(rows) == len(rows), "six independent rows", matrix_rank),
]


class IndenterSpec(Model, use_attribute_docstrings=True):
    """What touches the object."""

    shape: Literal["sphere"] = option(..., "of the tip", examples=["sphere"])
    radius_m: float = option(ge=1e-4, le=0.1)
    """the ball's radius [m], half of what a calliper says"""


class TargetSpec(Model, use_attribute_docstrings=True):
    """The probe's target: a checkerboard, a ChArUco board or an AprilGrid."""

    kind: Literal["checkerboard", "charuco", "aprilgrid"] = "checkerboard"
    """checkerboard, charuco or aprilgrid"""
    inner_corners: tuple[Corners, Corners] = CHECKERBOARD(checks=[ONE_ODD])
    """of a checkerboard in x and y, one odd and one even: 5 x 4 squares have [4, 3]"""
    squares: tuple[Few, Few] = CHARUCO("of a ChArUco board in x and y")
    tags: tuple[Few, Few] = APRILGRID("of an AprilGrid in x and y")
    square_m: float = SQUARED("side of a square [m], by a calliper over the whole board", **SIDE)
    tag_m: float = TAGGED("side of a tag with its black border [m], by a calliper", **SIDE)
    gap_m: float = APRILGRID(ge=0.0001, le=0.5)
    """between two tags of an AprilGrid [m]: Kalibr's tagSpacing times tagSize"""
    dictionary: Literal[*FAMILIES] = TAGGED("the family of the tags, by OpenCV's name")
    white_first: bool = WHITE("a ChArUco board's upper left is white")
    tag_turns: int = TURNS(ge=0, le=3)
    """right angles, clockwise, by which an AprilGrid's tags are turned"""

    def conflicts(self) -> Iterator[tuple]:
        """Corners too few, margins too narrow, and more tags than their family has."""
        if self.kind == "checkerboard":
            return
        available, cells = FAMILIES[self.dictionary]
        if self.kind == "charuco":
            columns, rows = self.squares
            count = (columns * rows + bool(self.white_first)) // 2
            if (columns - 1) * (rows - 1) < FEWEST_CORNERS:
                found = f"{columns} x {rows} squares"
                yield "squares", f"{FEWEST_CORNERS} inner corners or more", found
            if self.tag_m > self.square_m - 2 * LEAST_MARGIN * self.tag_m / cells:
                expected = f"margins of {LEAST_MARGIN:g} of a tag's cell on all sides of it"
                expected += f" in square_m ({self.square_m:g})"
                yield "tag_m", expected, f"{self.tag_m:g}"
        else:
            count = prod(self.tags)
            if self.gap_m < LEAST_GAP * self.tag_m:
                yield "gap_m", f"{LEAST_GAP:g} of tag_m or more", f"{self.gap_m:g}"
        if count > available:
            yield "dictionary", f"{count} tags or more", available


class TargetFile(Model):
    """A file that holds a target as a probe's file does."""

    marker: TargetSpec


class ExclusionSpec(Model, use_attribute_docstrings=True):
    """What of a cloud belongs to the probe."""

    radius_m: Reach
    """how far sensor, handle and hand reach from the probe's axis, above the tip [m]"""
    tip_radius_m: Reach
    """the tip, about the ball's centre [m]: the ball's radius to its diameter and 2 mm"""
    stem_m: Reach = None
    """how far above the ball's centre the probe is no thicker than the tip [m]"""
    board_radius_m: Reach = None
    """half the diagonal of the target's sheet [m], about the middle of its corners; with marker"""


class PayloadSpec(Model, use_attribute_docstrings=True):
    """What hangs on the force sensor, or calibration: of raw/sensors/<sensor>/load."""

    mass_kg: float = option(..., "its mass [kg], weighed", gt=0, le=10)
    mass_std_kg: float = option(None, "standard uncertainty of it [kg]", gt=0, le=1)
    centre_of_mass_m: tuple[Metres, Metres, Metres]
    """its centre of mass in the force sensor's frame [m]"""


class GaugeSpec(Model, use_attribute_docstrings=True):
    """For a sensor that records volts alone; one that records forces and torques needs none."""

    range_v: float = option(..., "the largest volts that are recorded", ge=0.1, le=1000)
    calibration: Gauges
    """rows fx, fy, fz [N/V], tx, ty, tz [Nm/V]; wrench = calibration (volts - at rest)"""


class ProbeSpec(Model, use_attribute_docstrings=True):
    """A force probe with a ball at its tip, and a target or a tracked frame on its handle."""

    probe: FileName = option(..., "a name of small letters, digits and _, like nano25_sphere")
    indenter: IndenterSpec
    marker: TargetSpec = None
    tracked: FrameName = None
    """whose poses probe_poses.csv holds, as it names it, like tool0; with marker the target's"""
    marker_from_force: Transform = option(
        ...,
        "the force sensor in the target's frame (origin at the first inner corner, x right and y"
        " down on the board, z into it), or in the tracked one, of the probe's drawing: columns are"
        " its axes x, y, z (z along the probe to the tip) and its origin [m]",
        examples=[NO_TRANSFORM],
    )
    force_from_tip: Transform = option(
        ...,
        "the ball's centre in the force sensor's frame: the last column [m], by a calliper",
        examples=[[[1, 0, 0, FILL_IN], [0, 1, 0, FILL_IN], [0, 0, 1, FILL_IN], [0, 0, 0, 1]]],
    )
    tip_covariance_m2: covariance_of(3) = None
    """of the tip's place in the target's or tracked frame [m^2], of palpate calibrate tip"""
    axes_std_rad: float = option(None, gt=0, le=0.5)
    """of the turn in marker_from_force, of palpate calibrate load"""
    tip: Source = option("stated", "calibration: of raw/sensors/<sensor>/pivot")
    axes: Source = "stated"
    """calibration: the turn in marker_from_force is that of raw/sensors/<sensor>/load"""
    exclusion: ExclusionSpec
    stiffness_n_m: Annotated[float, Field(gt=0, le=1e9)] | Literal["calibration"] = option(
        None,
        "between target and ball along the axis [N/m], of palpate calibrate stiffness; stiff if"
        " left out; calibration: of raw/sensors/<sensor>/stiffness",
    )
    compliance_std_m_n: float = option(None, gt=0, le=0.001)
    """of the compliance [m/N], of palpate calibrate stiffness"""
    load: PayloadSpec | Literal["calibration"] = None
    gauge: GaugeSpec = None

    def conflicts(self) -> Iterator[tuple]:
        """A radius unlike the tip in clouds (a tenth of it triples E); deviations said twice.

        And nothing by which the probe is followed.
        """
        if self.marker is None and self.tracked is None:
            yield "marker", "a value (or tracked, of poses of a robot or a tracker)", "nothing"
        if (self.marker is None) != (self.exclusion.board_radius_m is None):
            words = ("a value", "nothing") if self.marker else ("none without marker", "one")
            yield "exclusion.board_radius_m", *words
        radius_m, cloud = self.indenter.radius_m, self.exclusion
        tip_m, stem_m = cloud.tip_radius_m, cloud.stem_m or cloud.tip_radius_m
        arm_m = float(np.linalg.norm(np.array(self.force_from_tip, dtype=float)[:3, 3]))
        least_m = (tip_m - TIP_MARGIN_M) / 2
        if not least_m <= radius_m <= tip_m:
            expected = f"{least_m:g} to {tip_m:g}, by exclusion.tip_radius_m (one is wrong)"
            yield "indenter.radius_m", expected, f"{radius_m:g}"
        if cloud.radius_m < radius_m:
            expected = f"indenter.radius_m {radius_m:g} or more"
            yield "exclusion.radius_m", expected, f"{cloud.radius_m:g}"
        if not tip_m <= stem_m <= max(arm_m, tip_m):
            expected = f"tip_radius_m {tip_m:g} to the sensor's place {arm_m:g}"
            yield "exclusion.stem_m", expected, f"{stem_m:g}"
        for part, fields in DEVIATIONS.items():
            for field, deviation in fields.items():
                if (
                    getattr(self, field) == CALIBRATION
                    and getattr(self, deviation, None) is not None
                ):
                    yield deviation, f"none beside {field}: calibration ({part}.json has it)", "one"


@dataclass(frozen=True)
class Part:
    """A part of a probe that a recording determines."""

    name: str  # of results/sensors/<sensor>/<name>.json
    recording: str  # its folder's name, of raw/sensors/<sensor>/<recording>
    shows: str  # what the recording is of
    # Fields of the probe's file that may say `calibration`, each with the field of its deviation,
    # which the recording determines too.
    deviations: Mapping[str, str]
    force: bool = True  # whether the recording has forces

    def asking(self, probe: Mapping) -> str | None:
        """The first field of a probe's file that asks for the part."""
        return next((key for key in self.deviations if probe.get(key) == CALIBRATION), None)


# In the order in which they are taken: where the tip is in the sensor's frame depends on its axes.
PARTS = (
    Part("load", "load", "the probe held free", DEVIATIONS["load"]),
    Part("tip", "pivot", "the turning handle", DEVIATIONS["tip"], force=False),
    Part("stiffness", "stiffness", "a press on something rigid", DEVIATIONS["stiffness"]),
)


def asked(probe: Mapping) -> dict[str, str]:
    """Parts that a probe's file asks for, as `PARTS` are ordered, each with its field."""
    return {part.name: field for part in PARTS if (field := part.asking(probe))}


def require_met(unmet: Mapping[str, str], probe: Mapping) -> None:
    """Raise ValueError for parts that a probe's file asks for, by field, and no calibration has."""
    for part, field in unmet.items():
        expected = f"the {part}.json that the file of {probe['probe']} asks for"
        raise ValueError(f"{field}: expected {expected}, found none")


def as_stated(probe: Mapping, known: Collection[str] = ()) -> Mapping:
    """A probe's file that asks for no part but known ones: what it states of others counts."""
    unknown = {field for part in PARTS if part.name not in known for field in part.deviations}
    return {k: v for k, v in probe.items() if not (k in unknown and v == CALIBRATION)}
