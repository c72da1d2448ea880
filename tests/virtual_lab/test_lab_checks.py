"""Configurations of the lab that make no sense, and what it writes of its objects."""

import copy
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from palpate.config.model import problems
from virtual_lab.checks import lab_problems
from virtual_lab.describe import box_template, bumped, misdeclared, object_text
from virtual_lab.rig_errors import errors_of, sphere_radius_m
from virtual_lab.rules import LabRules
from virtual_lab.specification import Lab


def test_the_configurations_that_are_here_make_sense(lab, sensors, own, root, monkeypatch):
    """The lab's, and the own object's, of which points lie on its mesh."""
    monkeypatch.chdir(root)
    assert lab_problems(lab, sensors, "lab.yaml") == []
    lab, sensor, _ = own
    assert lab_problems(lab, {"bench_cam": sensor}, "lab.yaml") == []
    cow = lab["objects"]["toy_cow"]
    cow["object"]["points"]["back"]["position_m"] = [0.0189, 0.0, 0.06]
    (line,) = lab_problems(lab, {"bench_cam": sensor}, "lab.yaml")
    assert "points.back.position_m: expected on the mesh's surface" in line
    cow["shape"]["file"] = "tests/own_object/raw/toy_cow/template.ply"
    (line,) = lab_problems(lab, {"bench_cam": sensor}, "lab.yaml")
    assert "shape.file: tests/own_object/raw/toy_cow/template.ply: mesh: expected z from" in line


BLOCK, BALL, EAR = (("objects", name) for name in ("foam_block", "foam_ball", "ear"))
POINT = (*BLOCK, "object", "points", "08")
RELAXATION = (*BLOCK, "material", "relaxation")
CORRUPTED = [
    ((*BLOCK, "motion", "depth_m"), 0.02, "motion.depth_m: expected less than"),
    ((*BLOCK, "contact", "deepest_m"), 0.05, "contact.deepest_m: expected less"),
    ((*POINT, "position_m"), [0.4, 0, 0.0475], "08.position_m: expected on the block's top face"),
    ((*POINT, "direction"), [1.0, 0, -0.5], "08.direction: expected within 45 degrees"),
    ((*BALL, "object", "points", "01", "position_m"), [0, 0, 0.3], "expected on the ball's top"),
    ((*EAR, "object", "points", "01", "position_m"), [0, 0, 0.3], "expected on the ear's surface"),
    ((*BLOCK, "cameras", "kinect", "distance_m"), 0.3,
     "cameras.kinect.distance_m: expected 0.5 to 8.0 (the sensor's range), found 0.3"),
    ((*BLOCK, "material", "law"), "blatz_ko", "material.poisson_ratio: expected > 0, found 0"),
    ((*RELAXATION, "fractions"), [0.6, 0.5], "material.relaxation.fractions: expected a sum < 1"),
    ((*RELAXATION, "times_s"), [0.3],
     "material.relaxation: expected as many fractions as times, found 2 and 1"),
    ((*BLOCK, "recordings", "kinect"), ["19"], "found 19"),
    ((*BLOCK, "motion", "release_s"), 1.0, "motion.hold_s: expected for release_s, found nothing"),
    ((*BLOCK, "motions"), {"99": {"rest_s": 5.0}}, "motions: expected captures of recordings"),
    ((*BLOCK, "motions"), {"01": {"depth_m": 0.02}}, "motion.depth_m: expected less than"),
    ((*BLOCK, "pressed_at"), {"01": [0.4, 0, 0.0475]}, "pressed_at.01: expected on the block's"),
    ((*BLOCK, "contact", "table_friction"), 0.5,
     "object.support.contact: expected resting with contact.table_friction, found bonded"),
    ((*EAR, "contact", "glued"), 0.5, "glued: expected for shape.kind block, found for ear"),
    (("poses",), {"stand": {}}, "base.name of its file among stand, found base_link"),
    ((*BLOCK, "seeded_as"), {}, "kinect_cloud: expected seeded_as a sensor with a depth camera"),
    (("device",), {"declared_m": 0.002}, "expected of an object without mirrors, found mirrors"),
    (("experiments", "loading", "object"), "sponge", "found sponge"),
    (("experiments", "planes", "distances_m", "kinect"), [9.0], "found 9.0"),
    (("experiments", "calibration", "sensors"), ["bumblebee"], "with an infrared camera"),
]  # fmt: skip


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


def test_points_are_declared_beside_the_indentation(lab):
    """In object.yaml alone, about a size along x and y."""
    spec, errors = lab["objects"]["foam_block"], {"seed": 1, "device": {"declared_m": 0.002}}
    there = spec["object"]["points"]
    assert misdeclared(spec, {}, name="a") == spec
    declared, again, other = (
        yaml.safe_load(object_text(misdeclared(spec, errors, name=name), name=name))["points"]
        for name in ("a", "a", "b")
    )
    assert declared == again != other
    away = np.array([np.subtract(declared[k]["position_m"], there[k]["position_m"]) for k in there])
    assert away[:, :2].std() == pytest.approx(0.002, rel=0.3)
    assert not away[:, 2].any()


def test_a_template_in_error_has_smooth_bumps():
    errors = {"seed": 1, "device": {"template_m": 0.0006}}
    plain = box_template(np.array([0.2, 0.12, 0.05]), 0.015)
    template = plain.copy()
    bumped(template, errors, name="a")
    away = template.vertices - plain.vertices
    height = (away * plain.vertex_normals).sum(axis=1)
    assert np.linalg.norm(away, axis=1) == pytest.approx(np.abs(height), abs=1e-9)
    above = plain.vertices[:, 2] > 0.01
    assert height[above].std() == pytest.approx(0.0006, rel=0.3)
    assert not height[plain.vertices[:, 2] == 0].any()
    top = plain.edges_unique[(plain.vertices[plain.edges_unique, 2] == 0.05).all(axis=1)]
    # Independent ends of edges would differ by 1.4 times their deviation.
    assert np.diff(height[top], axis=1).std() < 0.8 * height[top].std()
    assert template.is_watertight


def test_what_is_written_of_an_object_has_its_own_errors_alone(lab):
    lab = copy.deepcopy(lab)
    lab["device"] = {"declared_m": 0.002, "template_m": 0, "focal": 0.1}
    rules, ball = LabRules(SimpleNamespace(lab=lab)), SimpleNamespace(object="foam_ball")
    assert rules.written(ball) == {"seed": lab["seed"], "device": {"declared_m": 0.002}}
    lab["objects"]["foam_ball"]["device"] = {}
    assert rules.written(ball) == {}


def test_the_sphere_of_a_rig_is_the_one_that_indents(lab, common, sensors, probe):
    """The contact is solved, and the probe moved, with the radius as it is."""
    lab = copy.deepcopy(lab)
    own = {"rig": "a", "device": {"radius": 0.01, "focal": 0.1}}
    lab["objects"]["foam_block"] |= own
    rules = LabRules(SimpleNamespace(lab=lab))
    params = {name: rules.mechanics(SimpleNamespace(object=name)) for name in lab["objects"]}
    solved_m = sphere_radius_m(params["foam_block"], params["foam_block"], probe)
    moved_m = errors_of(common, own, sensors["kinect"]).probe(probe)["indenter"]["radius_m"]
    assert solved_m == moved_m
    assert 1e-4 < abs(solved_m / 0.00622 - 1) < 0.04
    assert sphere_radius_m(params["ear"], params["ear"], probe) == 0.00622
    # Nothing else of the rig is the mechanics' business.
    assert set(params["ear"]) == {"shape", "material", "contact", "points"}
    assert params["foam_block"]["device"] == {"radius": 0.01}
