"""Configurations of the lab that make no sense."""

import copy

import pytest
import yaml
from virtual_lab.checks import lab_problems


@pytest.fixture(scope="module")
def lab(root):
    return yaml.safe_load((root / "config/lab.yaml").read_text())


def test_the_labs_own_configuration_is_right(lab, sensors):
    assert lab_problems(lab, sensors, "lab.yaml") == []


SPOILT = [
    (("objects", "foam_block", "motion", "depth_m"), 0.02, "motion.depth_m: expected less than"),
    (("objects", "foam_block", "contact", "deepest_m"), 0.05, "contact.deepest_m: expected less"),
    (
        ("objects", "foam_block", "object", "points", "08", "position_m"),
        [0.4, 0, 0.0475],
        "object.points.08.position_m: expected on the block's top face, found [0.4, 0.0, 0.0475]",
    ),
    (
        ("objects", "foam_ball", "object", "points", "01", "position_m"),
        [0, 0, 0.3],
        "expected on the ball's top",
    ),
    (
        ("objects", "ear", "object", "points", "01", "position_m"),
        [0, 0, 0.3],
        "expected on the ear's surface",
    ),
    (
        ("objects", "foam_block", "cameras", "kinect", "distance_m"),
        0.3,
        "cameras.kinect.distance_m: expected 0.5 to 8.0 (the sensor's range), found 0.3",
    ),
    (
        ("objects", "foam_block", "material", "relaxation", "fractions"),
        [0.6, 0.5],
        "material.relaxation.fractions: expected a sum < 1",
    ),
    (("objects", "foam_block", "recordings", "kinect"), ["19"], "found 19"),
    (
        ("objects", "foam_block", "motion", "release_s"),
        1.0,
        "motion.hold_s: expected for release_s, found nothing",
    ),
    (
        ("objects", "foam_block", "motions"),
        {"99": {"rest_s": 5.0}},
        "motions: expected captures of recordings, found 99",
    ),
    (
        ("objects", "foam_block", "motions"),
        {"01": {"depth_m": 0.02}},
        "motion.depth_m: expected less than",
    ),
    (
        ("objects", "foam_block", "pressed_at"),
        {"01": [0.4, 0, 0.0475]},
        "pressed_at.01: expected on the block's top face, found [0.4, 0.0, 0.0475]",
    ),
    (
        ("objects", "foam_block", "pressed_along"),
        {"01": [1.0, 0, -0.5]},
        "pressed_along.01: expected within 45 degrees of straight down",
    ),
    (
        ("objects", "foam_block", "pressed_along"),
        {"99": [0.0, 0, -1.0]},
        "pressed_along: expected captures of recordings, found 99",
    ),
    (
        ("objects", "foam_block", "contact", "table_friction"),
        0.5,
        "object.support.contact: expected resting with contact.table_friction, found bonded",
    ),
    (
        ("objects", "ear", "contact", "glued"),
        0.5,
        "contact.glued: expected for shape.kind block, found for ear",
    ),
    (
        ("objects", "foam_block", "object", "points", "08", "direction"),
        [1.0, 0, -0.5],
        "points.08.direction: expected within 45 degrees of straight down",
    ),
    (
        ("device",),
        {"declared_m": 0.002},
        "foam_block.device.declared_m: expected of an object without mirrors, found mirrors",
    ),
    (("experiments", "loading", "object"), "sponge", "found sponge"),
    (("experiments", "planes", "distances_m", "kinect"), [9.0], "found 9.0"),
    (("experiments", "calibration", "sensors"), ["bumblebee"], "with an infrared camera"),
]


@pytest.mark.parametrize(("place", "value", "said"), SPOILT, ids=[s[0][-1] for s in SPOILT])
def test_nonsense_is_one_line(lab, sensors, place, value, said):
    spoilt = copy.deepcopy(lab)
    block = spoilt
    for key in place[:-1]:
        block = block[key]
    block[place[-1]] = value
    lines = lab_problems(spoilt, sensors, "lab.yaml")
    assert any(said in line for line in lines), lines
    assert all(line.startswith("lab.yaml: ") and "\n" not in line for line in lines)


def test_blatz_ko_needs_a_positive_poisson_ratio(lab, sensors):
    spoilt = copy.deepcopy(lab)
    spoilt["objects"]["foam_block"]["material"] |= {"law": "blatz_ko", "poisson_ratio": 0}
    assert "poisson_ratio" in lab_problems(spoilt, sensors, "lab.yaml")[0]
