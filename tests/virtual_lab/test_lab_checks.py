"""Configurations of the lab that make no sense."""

import copy

import pytest
from palpate.config.model import problems
from virtual_lab.checks import lab_problems
from virtual_lab.specification import Lab


def test_the_labs_own_configuration_is_right(lab, sensors):
    assert lab_problems(lab, sensors, "lab.yaml") == []


BLOCK, BALL, EAR = (("objects", name) for name in ("foam_block", "foam_ball", "ear"))
POINT = (*BLOCK, "object", "points", "08")
CORRUPTED = [
    ((*BLOCK, "motion", "depth_m"), 0.02, "motion.depth_m: expected less than"),
    ((*BLOCK, "contact", "deepest_m"), 0.05, "contact.deepest_m: expected less"),
    ((*POINT, "position_m"), [0.4, 0, 0.0475], "08.position_m: expected on the block's top face"),
    ((*POINT, "direction"), [1.0, 0, -0.5], "08.direction: expected within 45 degrees"),
    ((*BALL, "object", "points", "01", "position_m"), [0, 0, 0.3], "expected on the ball's top"),
    ((*EAR, "object", "points", "01", "position_m"), [0, 0, 0.3], "expected on the ear's surface"),
    (
        (*BLOCK, "cameras", "kinect", "distance_m"),
        0.3,
        "cameras.kinect.distance_m: expected 0.5 to 8.0 (the sensor's range), found 0.3",
    ),
    ((*BLOCK, "material", "law"), "blatz_ko", "material.poisson_ratio: expected > 0, found 0"),
    (
        (*BLOCK, "material", "relaxation", "fractions"),
        [0.6, 0.5],
        "material.relaxation.fractions: expected a sum < 1",
    ),
    (
        (*BLOCK, "material", "relaxation", "times_s"),
        [0.3],
        "material.relaxation: expected as many fractions as times, found 2 and 1",
    ),
    ((*BLOCK, "recordings", "kinect"), ["19"], "found 19"),
    ((*BLOCK, "motion", "release_s"), 1.0, "motion.hold_s: expected for release_s, found nothing"),
    ((*BLOCK, "motions"), {"99": {"rest_s": 5.0}}, "motions: expected captures of recordings"),
    ((*BLOCK, "motions"), {"01": {"depth_m": 0.02}}, "motion.depth_m: expected less than"),
    ((*BLOCK, "pressed_at"), {"01": [0.4, 0, 0.0475]}, "pressed_at.01: expected on the block's"),
    (
        (*BLOCK, "contact", "table_friction"),
        0.5,
        "object.support.contact: expected resting with contact.table_friction, found bonded",
    ),
    (
        (*EAR, "contact", "glued"),
        0.5,
        "contact.glued: expected for shape.kind block, found for ear",
    ),
    (("poses",), {"stand": {}}, "base.name of its file among stand, found base_link"),
    ((*BLOCK, "seeded_as"), {}, "kinect_cloud: expected seeded_as a sensor with a depth camera"),
    (("device",), {"declared_m": 0.002}, "expected of an object without mirrors, found mirrors"),
    (("experiments", "loading", "object"), "sponge", "found sponge"),
    (("experiments", "planes", "distances_m", "kinect"), [9.0], "found 9.0"),
    (("experiments", "calibration", "sensors"), ["bumblebee"], "with an infrared camera"),
]


def changed(lab, place, value):
    """A lab with another value at a place, and the block that has it."""
    corrupted = copy.deepcopy(lab)
    block = corrupted
    for key in place[:-1]:
        block = block[key]
    block[place[-1]] = value
    return corrupted, block


@pytest.mark.parametrize(("place", "value", "line"), CORRUPTED, ids=[s[0][-1] for s in CORRUPTED])
def test_nonsense_is_one_line(lab, sensors, place, value, line):
    corrupted, block = changed(lab, place, value)
    if value == "blatz_ko":
        block["poisson_ratio"] = 0
    lines = lab_problems(corrupted, sensors, "lab.yaml")
    assert any(line in found for found in lines), lines
    assert all(found.startswith("lab.yaml: ") and "\n" not in found for found in lines)


@pytest.mark.parametrize(
    ("place", "value", "line"),
    [
        (("device",), {"baselin": 0.1}, "device.baselin: expected one of baseline, "),
        ((*BLOCK, "device"), {"baselin": 0.1}, "device.baselin: expected one of baseline, "),
        (("device",), {"baseline": -0.1}, "device.baseline: expected a number >= 0, found -0.1"),
        ((*BLOCK, "device"), {"baseline": "wide"}, "baseline: expected a number, found 'wide'"),
        ((*BLOCK, "material", "poisson_ratio"), 0.5, "material.poisson_ratio: expected "),
        ((*BLOCK, "material", "youngs_modulus_pa"), 0, "material.youngs_modulus_pa: expected "),
    ],
)
def test_a_field_that_makes_no_sense_is_one_line(lab, place, value, line):
    (found,) = problems(Lab, changed(lab, place, value)[0], "lab.yaml")
    assert found.startswith(f"lab.yaml: {'.'.join(place)}") and line in found
