"""Optics and gauges that no device has."""

import copy

import cv2
import pytest
from palpate.capture.device_checks import (
    BITS,
    TAGS,
    ambiguous_boards,
    bent_transforms,
    dead_gauges,
    impossible_optics,
    unlike_tips,
)
from palpate.capture.schema import SCHEMAS, load_yaml

PATHS = {"sensors": "sensors", "probes": "probes"}


def test_the_projects_own_are_right(sensors, probe):
    assert impossible_optics(sensors, PATHS) == []
    assert dead_gauges({"a": probe}, "probes") == []
    assert dead_gauges({"a": {"probe": "a"}}, "probes") == []


@pytest.mark.parametrize(
    ("part", "centre", "found"), [("color", "cx_px", -3), ("depth", "cy_px", 9e3)]
)
def test_an_axis_beside_the_image(sensors, part, centre, found):
    kinect = copy.deepcopy(sensors["kinect"])
    kinect[part][centre] = found
    (line,) = impossible_optics({"kinect": kinect}, PATHS)
    assert line.startswith(f"sensors/kinect.yaml: {part}.{centre}: expected within the image, 0 to")
    assert line.endswith(f"found {found:g}")


def test_gauges_that_leave_a_part_out(probe):
    probe = copy.deepcopy(probe)
    probe["gauge"]["calibration"][4] = probe["gauge"]["calibration"][1]
    (line,) = dead_gauges({"a": probe}, "probes")
    assert line == "probes/a.yaml: gauge.calibration: expected six independent rows, found 5"


def test_a_shift_in_millimetres(sensors, probe):
    probe = copy.deepcopy(probe)
    probe["marker_from_force"][0][3] = 30.0
    (line,) = bent_transforms({"a": probe}, {}, PATHS)
    assert line.endswith("expected a rotation and a shift, found a shift of 30 m (metres?)")


@pytest.mark.parametrize(("stem_m", "lines"), [(0.03, 0), (0.001, 1), (0.061, 1)])
def test_a_stem_between_tip_and_sensor(probe, stem_m, lines):
    probe = copy.deepcopy(probe)
    probe["exclusion"]["stem_m"] = stem_m
    found = unlike_tips({"a": probe}, "probes")
    said = (
        "probes/a.yaml: exclusion.stem_m: expected tip_radius_m 0.0085 to the sensor's place 0.06"
    )
    assert found == [f"{said}, found {stem_m:g}"] * lines


@pytest.mark.parametrize("factor", [0.1, 0.5, 2])
def test_a_sphere_of_another_size_than_the_tip(probe, factor):
    assert unlike_tips({"a": probe}, "probes") == []
    probe = copy.deepcopy(probe)
    probe["indenter"]["radius_m"] *= factor
    (line,) = unlike_tips({"a": probe}, "probes")
    assert line.startswith("probes/a.yaml: exclusion.tip_radius_m: expected indenter.radius_m")


def test_a_stereo_head_that_is_not_rectified(sensors):
    bent = sensors["bumblebee"] | {
        "color": sensors["bumblebee"]["color"] | {"distortion": [-0.3, 0.1, 0, 0, 0]}
    }
    lines = impossible_optics({"bumblebee": bent}, {"sensors": "config/sensors"})
    assert lines == [
        "config/sensors/bumblebee.yaml: color.distortion: expected zeros (rectified),"
        " found [-0.3, 0.1, 0, 0, 0]"
    ]


def test_boards_that_could_not_be_read():
    """Tags without a margin, between each other or in their squares, and too few corners."""
    charuco = {"kind": "charuco", "squares": [7, 5], "dictionary": "4X4_50"}
    charuco |= {"square_m": 0.015, "tag_m": 0.0145}
    few = charuco | {"squares": [3, 3], "tag_m": 0.01125}
    grid = {"kind": "aprilgrid", "tags": [4, 3], "tag_m": 0.02, "gap_m": 0.001}
    grid |= {"dictionary": "APRILTAG_36H11"}
    probes = {
        name: {"marker": marker} for name, marker in zip("abc", (charuco, few, grid), strict=True)
    }
    assert ambiguous_boards(probes, "p") == [
        "p/a.yaml: marker.tag_m: expected margins of 0.7 of a tag's cell on all sides of it in"
        " square_m (0.015), found 0.0145",
        "p/b.yaml: marker.squares: expected 6 inner corners or more, found 3 x 3 squares",
        "p/c.yaml: marker.gap_m: expected 0.1 of tag_m or more, found 0.001",
    ]


def test_tags_that_do_not_fit():
    grid = {"kind": "aprilgrid", "tags": [6, 6], "tag_m": 0.02, "gap_m": 0.006}
    probes = {
        "one": {"marker": grid | {"dictionary": "APRILTAG_25H9"}},
        "two": {"marker": grid | {"dictionary": "APRILTAG_36H11"}},
    }
    assert ambiguous_boards(probes, "config/probes") == [
        "config/probes/one.yaml: marker.dictionary: expected 36 tags or more, found 35"
    ]


def test_families_are_opencvs():
    """Their names, how many tags each has, and the cells along one."""
    schema = load_yaml(SCHEMAS / "probe.schema.yaml")
    names = schema["properties"]["marker"]["properties"]["dictionary"]["enum"]
    known = {name[5:] for name in dir(cv2.aruco) if name.startswith("DICT_") and name.isupper()}
    assert set(names) == known
    for name in names:
        family = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))
        assert (TAGS.get(name) or int(name.rpartition("_")[2])) == len(family.bytesList)
        assert (BITS.get(name) or BITS[name.partition("_")[0]]) == family.markerSize + 2
