"""Optics and gauges that no device has."""

import copy

import cv2
import numpy as np
import pytest
import yaml
from palpate.capture.device_checks import (
    BITS,
    TAGS,
    ambiguous_boards,
    bent_transforms,
    dead_gauges,
    impossible_optics,
    said_twice,
    unlike_tips,
    unsure_tips,
)
from palpate.capture.devices import read_device
from palpate.capture.schema import SCHEMAS, load_yaml, validate

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


def test_covariances_that_no_tip_has(probe):
    right = [[4e-10, 1e-10, 0], [1e-10, 4e-10, 0], [0, 0, 9e-10]]
    assert unsure_tips({"a": probe}, "p") == []
    for rows, told in (
        (right, ""),
        ([[4e-10, 1e-10, 0], [2e-10, 4e-10, 0], right[2]], "a symmetric matrix, found 1e-10 and"),
        ([[4e-10, 5e-10, 0], [5e-10, 4e-10, 0], right[2]], "variances above 0 in all directions"),
        (np.eye(3).tolist(), "deviations up to 0.02 m, found 1 m (square metres?)"),
    ):
        found = unsure_tips({"a": probe | {"tip_covariance_m2": rows}}, "p")
        assert len(found) == bool(told)
        assert all(f"p/a.yaml: tip_covariance_m2: expected {told}" in line for line in found)
    asks = probe | {"tip": "calibration", "tip_covariance_m2": right}
    (line,) = said_twice({"a": asks}, "p")
    assert "expected none beside tip: calibration (tip.json has it), found one" in line


@pytest.mark.parametrize(
    ("field", "deviation", "file"),
    [
        ("axes", "axes_std_rad", "load.json"),
        ("stiffness_n_m", "compliance_std_m_n", "stiffness.json"),
    ],
)
def test_a_deviation_of_what_is_asked_for(probe, field, deviation, file):
    asks = probe | {field: "calibration"}
    assert said_twice({"a": asks}, "p") == []
    (line,) = said_twice({"a": asks | {deviation: 1e-6}}, "p")
    expected = f"expected none beside {field}: calibration ({file} has it), found one"
    assert line == f"p/a.yaml: {deviation}: {expected}"


@pytest.mark.parametrize(
    ("known", "told"),
    [
        ({"compliance_std_m_n": -1e-6}, "compliance_std_m_n: expected a number > 0, found -1e-06"),
        ({"load": "weighed"}, "load: expected calibration, found 'weighed'"),
        ({"stiffness_n_m": [1]}, "stiffness_n_m: expected a number or a text, found [1]"),
        ({"axes_std_rad": 0}, "axes_std_rad: expected a number > 0, found 0"),
        ({"axes_std_rad": "1 deg"}, "axes_std_rad: expected a number, found '1 deg'"),
        ({"tip_std_m": 1e-5}, "tip_std_m: expected one of axes, axes_std_rad, compliance_std_m_n"),
        ({"tip_covariance_m2": [[1e-9] * 3] * 2}, "covariance_m2: expected at least 3 entries"),
        ({"tip_covariance_m2": [[1e-9] * 4] + [[1e-9] * 3] * 2}, "m2.0: expected at most 3 entr"),
    ],
)
def test_a_wrong_uncertainty_is_one_line(probe, known, told):
    (line,) = validate(probe | known, SCHEMAS / "probe.schema.yaml", "p.yaml")
    assert told in line


def test_uncertainties_stand_in_a_probes_file(probe, tmp_path):
    known = {"axes_std_rad": 0.001, "compliance_std_m_n": 2e-6}
    known |= {"tip_covariance_m2": (np.eye(3) * 1e-9).tolist()}
    known |= {"load": probe["load"] | {"mass_std_kg": 4e-5}}
    path = tmp_path / "nano25_sphere.yaml"
    path.write_text(yaml.safe_dump(probe | known))
    assert read_device(path, "probes") == (probe | known, ())
    known["tip_covariance_m2"][0][0] = -1e-9
    path.write_text(yaml.safe_dump(probe | known))
    (line,) = read_device(path, "probes")[1]
    assert f"{path}: tip_covariance_m2: expected variances above 0" in line


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
