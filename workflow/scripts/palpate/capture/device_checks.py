"""What is wrong with files of sensors and probes beyond their schemas, a line for each thing."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from palpate.capture.calibrations import CALIBRATION, PARTS
from palpate.capture.schema import SCHEMAS, load_yaml, validate

# Eq. 4.12 as printed is a rotation to 1e-8; files may be rounded further.
ROTATION_TOLERANCE = 1e-4
# Parts of one probe, or of one sensor, are nearer to each other [m].
LONGEST_SHIFT_M = 2.0
# Tags of the families whose names do not end with their number.
TAGS = {
    "APRILTAG_16H5": 30,
    "APRILTAG_25H9": 35,
    "APRILTAG_36H10": 2320,
    "APRILTAG_36H11": 587,
    "ARUCO_MIP_36H12": 250,
    "ARUCO_ORIGINAL": 1024,
}
# Cells along a tag with its border of one.
BITS = {"4X4": 6, "5X5": 7, "6X6": 8, "7X7": 9, "ARUCO_ORIGINAL": 7, "ARUCO_MIP_36H12": 8}
BITS |= {"APRILTAG_16H5": 6, "APRILTAG_25H9": 7, "APRILTAG_36H10": 8, "APRILTAG_36H11": 8}
# White about a tag that OpenCV asks for, in cells; and between tags, in tags.
LEAST_MARGIN, LEAST_GAP = 0.7, 0.1
FEWEST_CORNERS = 6
# Of numbers that were rounded to four digits; a tip that is known worse is not.
SYMMETRY_TOLERANCE, LARGEST_TIP_STD_M = 1e-3, 0.02
# What depth images blur around a tip [m].
TIP_MARGIN_M = 0.002


def wrong_devices(sensors: Mapping, probes: Mapping, paths: Mapping) -> list[str]:
    """What no sensor or probe can be.

    Parameters
    ----------
    sensors, probes : mapping
        Specifications by name, right by their schemas.
    paths : mapping
        The folders ``sensors`` and ``probes``, for the lines.
    """
    lines = ambiguous_boards(probes, paths["probes"]) + impossible_optics(sensors, paths)
    lines += bent_transforms(probes, sensors, paths) + dead_gauges(probes, paths["probes"])
    lines += unlike_tips(probes, paths["probes"])
    return lines + unsure_tips(probes, paths["probes"]) + said_twice(probes, paths["probes"])


def ambiguous_boards(probes: Mapping, folder: str) -> list[str]:
    """Boards that look the same from both ends, or that can't be printed."""
    lines = []
    for name, probe in probes.items():
        if "inner_corners" not in probe["marker"]:
            lines += impossible_tags(probe["marker"], f"{_file(folder, name)}: marker")
            continue
        columns, rows = probe["marker"]["inner_corners"]
        if (columns + rows) % 2 == 0:
            place = f"{_file(folder, name)}: marker.inner_corners"
            lines.append(f"{place}: expected one odd and one even, found {columns}, {rows}")
    return lines


def wrong_board(content: object, source: str) -> list[str]:
    """What is wrong with a file that holds a ``marker`` block as a probe's does, a line each."""
    schema = load_yaml(SCHEMAS / "probe.schema.yaml")
    schema |= {"properties": {"marker": schema["properties"]["marker"]}, "required": ["marker"]}
    return validate(content, schema, source) or ambiguous_boards({source: content}, "")


def impossible_tags(marker: Mapping, place: str) -> list[str]:
    """Too few corners, tags without a margin, or more tags than their family has."""
    lines, family, tag_m = [], marker["dictionary"], marker["tag_m"]
    if "squares" in marker:
        columns, rows = marker["squares"]
        count = (columns * rows + bool(marker.get("white_first"))) // 2
        if (columns - 1) * (rows - 1) < FEWEST_CORNERS:
            lines.append(
                f"{place}.squares: expected {FEWEST_CORNERS} inner corners or more, found"
                f" {columns} x {rows} squares"
            )
        cell_m = tag_m / (BITS.get(family) or BITS[family.partition("_")[0]])
        largest_m = marker["square_m"] - 2 * LEAST_MARGIN * cell_m
        if tag_m > largest_m:
            lines.append(
                f"{place}.tag_m: expected margins of {LEAST_MARGIN:g} of a tag's cell on all sides"
                f" of it in square_m ({marker['square_m']:g}), found {tag_m:g}"
            )
    else:
        count = int(np.prod(marker["tags"]))
        if marker["gap_m"] < LEAST_GAP * tag_m:
            found = f"found {marker['gap_m']:g}"
            lines.append(f"{place}.gap_m: expected {LEAST_GAP:g} of tag_m or more, {found}")
    available = TAGS.get(family) or int(family.rpartition("_")[2])
    if count > available:
        lines.append(f"{place}.dictionary: expected {count} tags or more, found {available}")
    return lines


def _file(folder: str, name: str) -> str:
    """Path of a device's file; without a folder the name is one."""
    return f"{Path(folder) / name}.yaml" if folder else name


def impossible_optics(sensors: Mapping, paths: Mapping) -> list[str]:
    """Ranges that end before they begin, and optical axes that miss the image."""
    lines = []
    for name, sensor in sensors.items():
        place = f"{Path(paths['sensors']) / name}.yaml"
        near, far = sensor["range_m"]
        if near >= far:
            found = f"expected increasing distances, found {near:g}, {far:g}"
            lines.append(f"{place}: range_m: {found}")
        for part in ("color", "depth"):
            lines += _off_axis(place, part, sensor.get(part))
        if sensor["kind"] == "stereo" and any(sensor["color"]["distortion"]):
            found = sensor["color"]["distortion"]
            lines.append(f"{place}: color.distortion: expected zeros (rectified), found {found}")
    return lines


def _off_axis(place: str, part: str, block: Mapping | None) -> list[str]:
    """Lines for the coordinates of a principal point that lie outside its image."""
    sides = {"cx_px": "width_px", "cy_px": "height_px"} if block else {}
    return [
        f"{place}: {part}.{centre}: expected within the image, 0 to {block[side]}, found"
        f" {block[centre]:g}"
        for centre, side in sides.items()
        if not 0 <= block[centre] <= block[side]
    ]


def dead_gauges(probes: Mapping, folder: str) -> list[str]:
    """Calibrations that leave out a part of the wrench, whatever the gauges say."""
    lines = []
    for name, probe in probes.items():
        rows = np.array(probe.get("gauge", {}).get("calibration", np.eye(6)), dtype=float)
        rank = np.linalg.matrix_rank(rows)
        if rank < len(rows):
            place = f"{Path(folder) / name}.yaml: gauge.calibration"
            lines.append(f"{place}: expected six independent rows, found {rank}")
    return lines


def unlike_tips(probes: Mapping, folder: str) -> list[str]:
    """Spheres whose radius does not go with what of a cloud is the tip: the wrong unit, a diameter.

    The force at a depth says nothing of it: a tenth of the radius makes E three times as large.
    """
    lines = []
    for name, probe in probes.items():
        radius_m, exclusion = probe["indenter"]["radius_m"], probe["exclusion"]
        widest_m, place = 2 * radius_m + TIP_MARGIN_M, f"{Path(folder) / name}.yaml: exclusion"
        expected = f"expected indenter.radius_m {radius_m:g}"
        if not radius_m <= (found_m := exclusion["tip_radius_m"]) <= widest_m:
            lines.append(f"{place}.tip_radius_m: {expected} to {widest_m:g}, found {found_m:g}")
        if (found_m := exclusion["radius_m"]) < radius_m:
            lines.append(f"{place}.radius_m: {expected} or more, found {found_m:g}")
        tip_m, arm_m = exclusion["tip_radius_m"], float(np.linalg.norm(_tip_of(probe)))
        if not tip_m <= (found_m := exclusion.get("stem_m", tip_m)) <= max(arm_m, tip_m):
            expected = f"expected tip_radius_m {tip_m:g} to the sensor's place {arm_m:g}"
            lines.append(f"{place}.stem_m: {expected}, found {found_m:g}")
    return lines


def unsure_tips(probes: Mapping, folder: str) -> list[str]:
    """Covariances that no tip has."""
    lines = []
    for name, probe in probes.items():
        if (rows := probe.get("tip_covariance_m2")) is None:
            continue
        found = covariance_fault(rows)
        lines += [f"{_file(folder, name)}: tip_covariance_m2: {found}"] if found else []
    return lines


def said_twice(probes: Mapping, folder: str) -> list[str]:
    """Deviations of what a file does not state, but asks a calibration for."""
    return [
        f"{_file(folder, name)}: {deviation}: expected none beside {field}: calibration"
        f" ({part.name}.json has it), found one"
        for name, probe in probes.items()
        for part in PARTS
        for field, deviation in part.deviations.items()
        if probe.get(field) == CALIBRATION and deviation in probe
    ]


def covariance_fault(rows: Sequence) -> str:
    """What is wrong with a tip's covariance, 3 x 3 numbers [m^2]; empty where nothing is."""
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


def _tip_of(probe: Mapping) -> np.ndarray:
    return np.array(probe["force_from_tip"], dtype=float)[:3, 3]


def bent_transforms(probes: Mapping, sensors: Mapping, paths: Mapping) -> list[str]:
    """Transforms that turn and shift nothing rigidly."""
    places = [
        (Path(paths["probes"]) / f"{name}.yaml", key, probe[key])
        for name, probe in probes.items()
        for key in ("marker_from_force", "force_from_tip")
    ]
    places += [
        (Path(paths["sensors"]) / f"{name}.yaml", "color_from_depth", depth["color_from_depth"])
        for name, sensor in sensors.items()
        if (depth := sensor.get("depth"))
    ]
    return [
        f"{path}: {key}: expected a rotation and a shift, found {found}"
        for path, key, rows in places
        if (found := bent(rows))
    ]


def bent(rows: Sequence) -> str:
    """What is wrong with a rigid transform, 4 x 4 numbers; empty where nothing is."""
    transform = np.array(rows, dtype=float)
    turn = transform[:3, :3]
    if not np.abs(transform[:3, 3]).max() <= LONGEST_SHIFT_M:
        return f"a shift of {np.abs(transform[:3, 3]).max():g} m (metres?)"
    if not np.allclose(transform[3], [0, 0, 0, 1], atol=1e-9):
        return "another last row than 0, 0, 0, 1"
    if not np.allclose(turn @ turn.T, np.eye(3), atol=ROTATION_TOLERANCE):
        return "rows that are not square to each other and of length 1"
    return "" if np.linalg.det(turn) > 0 else "a mirrored one"
