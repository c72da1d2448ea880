"""The file of a force probe: ``config/probes/<probe>.yaml``."""

from collections.abc import Sequence
from math import prod
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from palpate.config.model import ABSENT, FILL_IN, FileName, Model, Vector, option, with_others
from palpate.config.sensor import NO_TRANSFORM, Transform

# OpenCV's families of tags: how many each has, and the cells along one with its border.
FAMILIES = {f"{n}X{n}_{k}": (k, n + 2) for n in (4, 5, 6, 7) for k in (50, 100, 250, 1000)} | {
    "APRILTAG_16H5": (30, 6),
    "APRILTAG_25H9": (35, 7),
    "APRILTAG_36H10": (2320, 8),
    "APRILTAG_36H11": (587, 8),
    "ARUCO_MIP_36H12": (250, 8),
    "ARUCO_ORIGINAL": (1024, 7),
}
# White about a tag that OpenCV asks for, in cells; and between tags, in tags.
LEAST_MARGIN, LEAST_GAP = 0.7, 0.1
FEWEST_CORNERS = 6
# Of numbers that were rounded to four digits; a tip that is known worse is not.
SYMMETRY_TOLERANCE, LARGEST_TIP_STD_M = 1e-3, 0.02
# What depth images blur around a tip [m].
TIP_MARGIN_M = 0.002
CALIBRATION = "calibration"
# Fields that may ask for a part's calibration, and those of what each is then known to.
DEVIATIONS = {
    "load": {"load": "load.mass_std_kg", "axes": "axes_std_rad"},
    "tip": {"tip": "tip_covariance_m2"},
    "stiffness": {"stiffness_n_m": "compliance_std_m_n"},
}


def covariance_fault(rows: Sequence) -> str:
    """Say what is wrong with a tip's covariance, 3 x 3 numbers [m^2]; empty where nothing is."""
    covariance = np.array(rows, dtype=float)
    if not np.allclose(covariance, covariance.T, rtol=SYMMETRY_TOLERANCE, atol=0):
        row, column = np.argwhere(~np.isclose(covariance, covariance.T, SYMMETRY_TOLERANCE, 0))[0]
        pair = f"{covariance[row, column]:.3g} and {covariance[column, row]:.3g}"
        return f"expected a symmetric matrix, found {pair} on two sides of its diagonal"
    least, *_, most = np.linalg.eigvalsh(covariance)
    if not least > 0:
        return f"expected variances above 0 in all directions, found {least:.3g}"
    if most > LARGEST_TIP_STD_M**2:
        found = f"{np.sqrt(most):.3g} m"
        return f"expected deviations up to {LARGEST_TIP_STD_M:g} m, found {found} (square metres?)"
    return ""


def _covariance(rows: tuple) -> tuple:
    if fault := covariance_fault(rows):
        raise ValueError(fault)
    return rows


def _independent(rows: tuple) -> tuple:
    """A calibration that leaves out no part of the wrench, whatever the gauges say."""
    if (rank := np.linalg.matrix_rank(np.array(rows, dtype=float))) < len(rows):
        raise ValueError(f"expected six independent rows, found {rank}")
    return rows


def _unlike_ends(corners: tuple) -> tuple:
    """A board that does not look the same from both ends."""
    if sum(corners) % 2 == 0:
        raise ValueError(f"expected one odd and one even, found {corners[0]}, {corners[1]}")
    return corners


CHECKERBOARD, CHARUCO = with_others("kind", "checkerboard"), with_others("kind", "charuco")
SQUARED, TAGGED = (with_others("kind", one, "charuco") for one in ("checkerboard", "aprilgrid"))
APRILGRID = with_others("kind", "aprilgrid")
WHITE = with_others("kind", "charuco", needed=False)
TURNS = with_others("kind", "aprilgrid", needed=False)
Few = Annotated[int, Field(ge=2, le=50)]
Corners = Annotated[int, Field(ge=3, le=50)]
Inner = Annotated[tuple[Corners, Corners], AfterValidator(_unlike_ends), CHECKERBOARD]
Side = Annotated[float, Field(ge=0.001, le=0.5)]
Reach = Annotated[float, Field(gt=0, le=1)]
Metres = Annotated[float, Field(ge=-1, le=1)]
Row6 = tuple[float, float, float, float, float, float]
Covariance = Annotated[tuple[Vector, Vector, Vector], AfterValidator(_covariance)]
Gauges = Annotated[tuple[Row6, Row6, Row6, Row6, Row6, Row6], AfterValidator(_independent)]
Stiffness = Annotated[float, Field(gt=0, le=1e9)]


class IndenterSpec(Model):
    """What touches the object."""

    shape: Literal["sphere"] = option(..., "of the tip", examples=["sphere"])
    radius_m: float = option(
        ..., "the ball's radius [m], half of what a calliper says", ge=1e-4, le=0.1
    )


class TargetSpec(Model):
    """The probe's target: a checkerboard, a ChArUco board or an AprilGrid."""

    kind: Literal["checkerboard", "charuco", "aprilgrid"] = option(
        "checkerboard", "checkerboard, charuco or aprilgrid"
    )
    inner_corners: Inner = option(
        ABSENT, "of a checkerboard in x and y, one odd and one even: 5 x 4 squares have [4, 3]"
    )
    squares: Annotated[tuple[Few, Few], CHARUCO] = option(ABSENT, "of a ChArUco board in x and y")
    tags: Annotated[tuple[Few, Few], APRILGRID] = option(ABSENT, "of an AprilGrid in x and y")
    square_m: Annotated[Side, SQUARED] = option(
        ABSENT, "side of a square [m], by a calliper over the whole board"
    )
    tag_m: Annotated[Side, TAGGED] = option(
        ABSENT, "side of a tag with its black border [m], by a calliper"
    )
    gap_m: Annotated[float, Field(ge=0.0001, le=0.5), APRILGRID] = option(
        ABSENT, "between two tags of an AprilGrid [m]: Kalibr's tagSpacing times tagSize"
    )
    dictionary: Annotated[Literal[*FAMILIES], TAGGED] = option(
        ABSENT, "the family of the tags, by OpenCV's name"
    )
    white_first: Annotated[bool, WHITE] = option(ABSENT, "a ChArUco board's upper left is white")
    tag_turns: Annotated[int, Field(ge=0, le=3), TURNS] = option(
        ABSENT, "right angles, clockwise, by which an AprilGrid's tags are turned"
    )

    @model_validator(mode="after")
    def _that_can_be_read(self) -> Self:
        """With corners enough, margins about tags, and no more tags than their family has."""
        lines = []
        if self.kind == "checkerboard":
            return self
        available, cells = FAMILIES[self.dictionary]
        if self.kind == "charuco":
            columns, rows = self.squares
            count = (columns * rows + bool(self.white_first)) // 2
            if (columns - 1) * (rows - 1) < FEWEST_CORNERS:
                expected = f"expected {FEWEST_CORNERS} inner corners or more"
                lines.append(f"squares: {expected}, found {columns} x {rows} squares")
            if self.tag_m > self.square_m - 2 * LEAST_MARGIN * self.tag_m / cells:
                expected = f"margins of {LEAST_MARGIN:g} of a tag's cell on all sides of it"
                expected += f" in square_m ({self.square_m:g})"
                lines.append(f"tag_m: expected {expected}, found {self.tag_m:g}")
        else:
            count = prod(self.tags)
            if self.gap_m < LEAST_GAP * self.tag_m:
                expected = f"{LEAST_GAP:g} of tag_m or more"
                lines.append(f"gap_m: expected {expected}, found {self.gap_m:g}")
        if count > available:
            lines.append(f"dictionary: expected {count} tags or more, found {available}")
        if lines:
            raise ValueError("\n".join(lines))
        return self


class TargetFile(Model):
    """A file that holds a target as a probe's file does."""

    marker: TargetSpec


class ExclusionSpec(Model):
    """What of a cloud belongs to the probe."""

    radius_m: Reach = option(
        ..., "how far sensor, handle and hand reach from the probe's axis, above the tip [m]"
    )
    tip_radius_m: Reach = option(
        ..., "the tip, about the ball's centre [m]: the ball's radius to its diameter and 2 mm"
    )
    stem_m: Reach = option(
        None, "how far above the ball's centre the probe is no thicker than the tip [m]"
    )
    board_radius_m: Reach = option(
        ..., "half the diagonal of the target's sheet [m], about the middle of its corners"
    )


class PayloadSpec(Model):
    """What hangs on the force sensor, or calibration: of raw/sensors/<sensor>/load."""

    mass_kg: float = option(..., "its mass [kg], weighed", gt=0, le=10)
    mass_std_kg: float = option(None, "standard uncertainty of it [kg]", gt=0, le=1)
    centre_of_mass_m: tuple[Metres, Metres, Metres] = option(
        ..., "its centre of mass in the force sensor's frame [m]"
    )


class GaugeSpec(Model):
    """For a sensor that records volts alone; one that records forces and torques needs none."""

    range_v: float = option(..., "the largest volts that are recorded", ge=0.1, le=1000)
    calibration: Gauges = option(
        ..., "rows fx, fy, fz [N/V], tx, ty, tz [Nm/V]; wrench = calibration (volts - at rest)"
    )


class ProbeSpec(Model):
    """A force probe with a ball at its tip and a target on its handle."""

    probe: FileName = option(..., "a name of small letters, digits and _, like nano25_sphere")
    indenter: IndenterSpec
    marker: TargetSpec
    marker_from_force: Transform = option(
        ...,
        "the force sensor in the target's frame (origin at the first inner corner, x right and y"
        " down on the board, z into it), of the probe's drawing: columns are its axes x, y, z (z"
        " along the probe to the tip) and its origin [m]",
        examples=[NO_TRANSFORM],
    )
    force_from_tip: Transform = option(
        ...,
        "the ball's centre in the force sensor's frame: the last column [m], by a calliper",
        examples=[[[1, 0, 0, FILL_IN], [0, 1, 0, FILL_IN], [0, 0, 1, FILL_IN], [0, 0, 0, 1]]],
    )
    tip_covariance_m2: Covariance = option(
        None, "of the tip's place in the target's frame [m^2], of palpate calibrate tip"
    )
    axes_std_rad: float = option(
        None, "of the turn in marker_from_force, of palpate calibrate load", gt=0, le=0.5
    )
    tip: Literal["stated", "calibration"] = option(
        "stated", "calibration: of raw/sensors/<sensor>/pivot"
    )
    axes: Literal["stated", "calibration"] = option(
        "stated", "calibration: the turn in marker_from_force is that of raw/sensors/<sensor>/load"
    )
    exclusion: ExclusionSpec
    stiffness_n_m: Stiffness | Literal["calibration"] = option(
        None,
        "between target and ball along the axis [N/m], of palpate calibrate stiffness; stiff if"
        " left out; calibration: of raw/sensors/<sensor>/stiffness",
    )
    compliance_std_m_n: float = option(
        None, "of the compliance [m/N], of palpate calibrate stiffness", gt=0, le=0.001
    )
    load: PayloadSpec | Literal["calibration"] = None
    gauge: GaugeSpec = None

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        if lines := [*self._unlike_tip(), *self._said_twice()]:
            raise ValueError("\n".join(lines))
        return self

    def _unlike_tip(self) -> list[str]:
        """A radius that does not go with what of a cloud is the tip: the wrong unit, a diameter.

        The force at a depth says nothing of it: a tenth of the radius makes E three times as large.
        """
        radius_m, tip_m = self.indenter.radius_m, self.exclusion.tip_radius_m
        arm_m = float(np.linalg.norm(np.array(self.force_from_tip, dtype=float)[:3, 3]))
        stem_m = tip_m if self.exclusion.stem_m is None else self.exclusion.stem_m
        widest_m, lines = 2 * radius_m + TIP_MARGIN_M, []
        expected = f"expected indenter.radius_m {radius_m:g}"
        if not radius_m <= tip_m <= widest_m:
            lines.append(f"tip_radius_m: {expected} to {widest_m:g}, found {tip_m:g}")
        if self.exclusion.radius_m < radius_m:
            lines.append(f"radius_m: {expected} or more, found {self.exclusion.radius_m:g}")
        if not tip_m <= stem_m <= max(arm_m, tip_m):
            expected = f"expected tip_radius_m {tip_m:g} to the sensor's place {arm_m:g}"
            lines.append(f"stem_m: {expected}, found {stem_m:g}")
        return [f"exclusion.{line}" for line in lines]

    def _said_twice(self) -> list[str]:
        """Deviations of what the file does not state, but asks a calibration for."""
        return [
            f"{deviation}: expected none beside {field}: calibration ({part}.json has it), found"
            " one"
            for part, fields in DEVIATIONS.items()
            for field, deviation in fields.items()
            if getattr(self, field) == CALIBRATION and getattr(self, deviation, None) is not None
        ]
