"""Indentations as operators make them: held, released, inclined, of an unbonded block."""

import numpy as np
import pytest
from palpate.vision.force import WRENCH, zeroed
from palpate.vision.indentation import frame_wrenches
from palpate.vision.options import Force
from palpate.vision.probe import marker_columns
from virtual_lab.indentation import contact_problem, indent_object
from virtual_lab.load_steps import LoadSteps, mirrored, read_load_steps, write_load_steps
from virtual_lab.motion import HOVER_M, Operator, ProbeMotion
from virtual_lab.record import FACING
from virtual_lab.shapes import shape_of
from virtual_lab.wrench import gauge_record, inertial_wrench

R = 0.00622
TILT_RAD = np.deg2rad(20)
INCLINED = np.array([np.sin(TILT_RAD), 0.0, -np.cos(TILT_RAD)])
STEADY = {"frame_rate_hz": 10, "rest_s": 0.5, "approach_s": 0.6, "press_s": 1.5}
STEADY |= {"approach_m": 0.015, "depth_m": 0.006, "pace_spread": 0.1, "lateral_tremor_m": 0.0006}
STEADY |= dict.fromkeys(("depth_spread", "tilt_deg", "tilt_tremor_deg", "depth_tremor_m"), 0.0)
TOP = np.array([0.0, 0.0, 0.02])
BLOCK = {
    "shape": {"kind": "block", "size_m": [0.05, 0.03, 0.02]},
    "material": {"law": "neo_hookean", "youngs_modulus_pa": 25000, "poisson_ratio": 0.3},
    "contact": {"step_m": 0.00075, "deepest_m": 0.0015, "element_m": 0.0015}
    | {"growth": 1.9, "reach_m": 0.009, "friction": 0.0},
}


def operator_of(seed=1, **options):
    rng = np.random.default_rng(seed)
    more = {key: options.pop(key) for key in ("direction",) if key in options}
    return Operator(STEADY | options, point_m=TOP, radius_m=R, facing=FACING, rng=rng, **more)


def test_motion_is_smooth_and_touches_at_the_point():
    operator = operator_of(frames=24, tilt_deg=4.0, tilt_tremor_deg=0.25, depth_tremor_m=3e-5)
    path = operator.at(np.arange(0, 4, 0.001))
    assert path.depth_m[0] == pytest.approx(-0.015)
    assert path.depth_m.max() == pytest.approx(0.006, abs=2e-4)
    assert np.abs(np.diff(path.tip_m, axis=0)).max() < 0.06 * 0.001 * 2
    assert np.abs((path.tip_m - TOP)[path.depth_m >= 0, :2]).max() < 1e-9
    assert np.allclose(TOP[2] - (path.tip_m[:, 2] - R), path.depth_m)
    assert np.allclose(np.linalg.det(path.object_from_force), 1)
    assert np.degrees(np.arccos(-path.object_from_force[:, 2, 2])).max() < 8


def test_a_recording_lasts_as_long_as_the_motion():
    for hold_s in (0.0, 5.0):
        operator = operator_of(hold_s=hold_s)
        ends_s = 0.5 + 0.6 + 1.5 * operator.pace + hold_s
        assert 0 <= ends_s - (operator.frames - 1) / 10 < 0.1
        depth = operator.at(np.array([ends_s - hold_s, ends_s])).depth_m
        assert depth == pytest.approx([0.006, 0.006])
    assert operator_of(frames=24).frames == 24


def test_a_release_is_the_loading_backwards():
    operator = operator_of(hold_s=0.7, release_s=1.5)
    deepest_s = 0.5 + 0.6 + 1.5 * operator.pace
    before = np.linspace(0, 1.5 * operator.pace, 40)
    pressing = operator.at(deepest_s - before).depth_m
    assert np.allclose(operator.at(deepest_s + 0.7 + before).depth_m, pressing)
    assert pressing[0] == pytest.approx(0.006) and pressing[-1] == pytest.approx(-HOVER_M)
    ends_s = deepest_s + 0.7 + 1.5 * operator.pace
    assert (operator.frames - 1) / 10 == pytest.approx(ends_s, abs=0.1)


def test_an_inclined_indentation_goes_along_its_line():
    operator = operator_of(frames=24, direction=INCLINED)
    path = operator.at(np.arange(0, 4, 0.01))
    away = path.tip_m - (TOP - R * INCLINED)
    assert np.allclose(away @ INCLINED, path.depth_m)
    touching = path.depth_m >= 0
    assert touching.any() and np.abs(np.cross(away[touching], INCLINED)).max() < 1e-12
    # The probe's axis lies along it, and its marker still faces the camera.
    assert np.allclose(path.object_from_force[:, :, 2], INCLINED)
    assert np.allclose(path.object_from_force[:, :, 1], FACING)


@pytest.fixture(scope="module")
def straight():
    return indent_object(BLOCK, TOP, R)


@pytest.fixture(scope="module")
def inclined():
    return indent_object(BLOCK, TOP, R, direction=2 * INCLINED)


@pytest.mark.long
def test_a_smooth_sphere_slides_on_a_flat_face(straight, inclined):
    """Only what it goes down counts, and its force is square to the face however it comes."""
    assert np.allclose(np.cross(inclined.point_m - TOP, INCLINED), 0, atol=1e-9)
    centre = inclined.point_m - R * INCLINED
    assert centre[2] == pytest.approx(TOP[2] + R, abs=1e-5)
    depth = inclined.depth_m[1:]
    force = inclined.force_vector_at(depth)
    assert force[:, 2] == pytest.approx(straight.force_at(depth * np.cos(TILT_RAD)), rel=0.04)
    assert np.abs(force[:, :2] / force[:, 2:]).max() < 0.03
    assert inclined.force_n[1:] == pytest.approx(-force @ INCLINED)


def test_load_steps_keep_their_direction(inclined, straight, tmp_path):
    write_load_steps(tmp_path / "inclined.npz", inclined)
    again = mirrored(read_load_steps(tmp_path / "inclined.npz"), TOP)
    assert np.array_equal(again.force_vector_at([0.001]), inclined.force_vector_at([0.001]))
    point = TOP + [0.01, 0, 0]
    moved = LoadSteps(**(vars(again) | {"point_m": again.point_m + [0.01, 0, 0]}))
    image = mirrored(moved, point * [-1, 1, 1])
    assert np.allclose(image.direction, INCLINED * [-1, 1, 1])
    assert np.allclose(image.force_vector_at([0.001]) @ [1, 1, 0], 0, atol=1e-2)
    # Straight down nothing says so.
    write_load_steps(tmp_path / "straight.npz", straight)
    with np.load(tmp_path / "straight.npz") as data:
        assert not {"direction", "heading"} & set(data.files)


def test_load_steps_of_a_mirror_image(steps):
    other = mirrored(steps, np.array([0.05, 0.0, 0.0475]))
    assert other.point_m.tolist() == [0.05, 0.0, 0.0475]
    assert other.force_at([0.004]) == pytest.approx(200 * 0.004**1.5, rel=1e-6)
    moved = np.abs(other.surface_at([0.009])[0] - other.surface_rest_m).max(axis=1)
    assert other.surface_rest_m[moved.argmax(), 0] > 0
    with pytest.raises(ValueError, match="direction: expected within the planes of symmetry"):
        indent_object(BLOCK, TOP, R, direction=[0.0, 0.3, -0.9])
    with pytest.raises(ValueError, match="point: expected a mirror image"):
        mirrored(steps, np.array([0.15, 0.0, 0.0475]))
    with pytest.raises(ValueError, match=r"depth: expected at most 0.0090 m, found 0.0100 m"):
        steps.force_at([0.01])


def test_the_sensor_records_the_force_as_it_is(inclined, probe):
    """Read as the tool reads it, the record gives the force's vector back."""
    lab = {"noise_v": 0.002, "bias_v": 0.3, "mass_kg": 0.03, "centre_of_mass_m": [0, 0, 0.035]}
    stiff = LoadSteps(**(vars(inclined) | {"force_n": 20 * inclined.force_n}))
    operator = operator_of(depth_m=0.0015, hold_s=1.0, direction=stiff.direction)
    path = operator.at(np.arange(0, 4, 0.001))
    force, turns = stiff.force_vector_at(path.depth_m), path.object_from_force
    record = gauge_record(path.time_s, force, turns, probe, lab, np.random.default_rng(0))
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, :3] = turns[0] @ np.array(probe["marker_from_force"])[:3, :3].T
    table = marker_columns(poses).assign(time_s=[0.3, 3.5])
    known = zeroed(record, probe, 0.4, 0.3)
    found = frame_wrenches(known, table, probe, Force(matching="linear"))[WRENCH].to_numpy()
    assert np.abs(found[:, :3] - [np.zeros(3), -force[3500]]).max() < 0.12
    # A normal force alone would be seen along the probe's axis.
    assert np.linalg.norm(np.cross(force[3500], INCLINED)) > 0.6


@pytest.mark.long
def test_a_rough_sphere_that_comes_slanting_drags_the_surface_along():
    """Five degrees off: the surface goes aside with it, and the force is tilted against that."""
    off = np.deg2rad(5)
    rough = {"contact": BLOCK["contact"] | {"friction": 0.5, "deepest_m": 0.00075}}
    along = [np.sin(off), 0.0, -np.cos(off)]
    steps = indent_object(BLOCK | rough, TOP, R, direction=along)
    force = steps.force_vector_at([0.00075])[0]
    assert 0.05 < -force[0] / force[2] < 0.15
    touched = np.argmin(np.linalg.norm(steps.surface_rest_m - TOP, axis=1))
    aside_m = steps.surface_displacement_m[-1, touched, 0]
    assert aside_m == pytest.approx(0.00075 * np.sin(off), rel=0.1)


def test_tremor_may_go_on_in_contact():
    time_s = np.arange(0, 4, 0.01)
    still, trembling = (operator_of(frames=24, **more) for more in ({}, {"contact_tremor_m": 1e-4}))
    paths = [operator.at(time_s) for operator in (still, trembling)]
    touching = paths[0].depth_m > 0
    aside = [(path.tip_m - TOP)[:, :2] for path in paths]
    assert not aside[0][touching].any()
    assert aside[1][touching].std() == pytest.approx(1e-4, rel=0.4)
    # High above it is the same.
    assert aside[1][0] == pytest.approx(aside[0][0])
    assert np.array_equal(paths[0].depth_m, paths[1].depth_m)


UNBONDED = BLOCK | {
    "shape": {"kind": "block", "size_m": [0.08, 0.06, 0.02]},
    "contact": BLOCK["contact"] | {"table_friction": 0.5, "growth": 2.5},
}


def test_an_unbonded_block_lifts_its_edges_and_bears_the_force(straight):
    model = shape_of(UNBONDED).model(TOP, UNBONDED["contact"])
    step = contact_problem(UNBONDED, model, TOP, R).indent(np.array([0.00075]))[0]
    sphere, table = step.forces_n
    assert table[2] == pytest.approx(-sphere[2], rel=1e-6) and -sphere[2] > 0
    nodes, moved = model.solid.nodes_m, step.displacement_m
    corner = np.argmax(nodes @ [1, 1, -100])
    assert nodes[corner] == pytest.approx([0.04, 0.03, 0]) and moved[corner, 2] > 1e-6
    # It yields as a bonded one does, or a little more.
    assert -4 * sphere[2] == pytest.approx(straight.force_n[1], rel=0.1)


@pytest.mark.long
def test_a_base_that_is_bonded_in_its_middle_alone_lifts_its_end():
    """Indented near an end it yields a little more than a bonded one, and its other end rises."""
    beside = TOP + [0.03, 0, 0]
    bonded = {k: v for k, v in UNBONDED["contact"].items() if k != "table_friction"}
    contact = bonded | {"deepest_m": 0.0015, "step_m": 0.0015}
    forces, lifts = [], []
    for more in ({}, {"glued": 1.0}, {"glued": 0.4}):
        steps = indent_object(UNBONDED | {"contact": contact | more}, beside, R)
        base = steps.surface_rest_m[:, 2] < 1e-9
        forces.append(steps.force_n[-1])
        lifts.append(steps.surface_displacement_m[-1, base, 2])
        middle = base & (np.abs(steps.surface_rest_m[:, :2]) < [0.01, 0.008]).all(axis=1)
        assert np.abs(steps.surface_displacement_m[-1, middle]).max() < 1e-6
    assert forces[1] == pytest.approx(forces[0], rel=1e-9)
    assert 0.9 < forces[2] / forces[0] < 0.995
    assert np.abs(lifts[1]).max() < 1e-9 < 1e-5 < lifts[2].max()
    # The table supports what goes down.
    assert lifts[2].min() > -1e-5


def test_pictures_of_a_quartered_block_are_symmetric():
    model = shape_of(UNBONDED).model(TOP, UNBONDED["contact"])
    x, y, z = model.solid.nodes_m.T
    field = model.sample(np.column_stack([x * z, x * x * y, x + y]))
    a, b, c = model.surface_rest_m.T
    expected = np.column_stack([a * c, a * a * b, abs(a) + abs(b)])
    assert field == pytest.approx(expected, abs=1e-9)


def test_inertia_is_mass_times_acceleration(common, probe):
    time_s, w = np.arange(0, 2, 0.001), 2 * np.pi * 5
    tip = np.column_stack([0.001 * np.sin(w * time_s), 0 * time_s, 0 * time_s])
    turn = np.broadcast_to(np.diag([1.0, -1.0, -1.0]), (len(time_s), 3, 3))
    path = ProbeMotion(time_s, 0 * time_s, tip, turn)
    options = common["force"] | {"centre_of_mass_m": [0, 0, 0.036]}
    load = inertial_wrench(path, probe, options)[5:-5]
    # A pull of 30 mN: 30 g at 1 m/s2.
    pull = options["mass_kg"] * 0.001 * w**2 * np.sin(w * time_s)[5:-5]
    assert load[:, 0] == pytest.approx(pull, abs=1e-4)
    assert load[:, 4] == pytest.approx(0.036 * pull, abs=1e-5)
    assert np.abs(load[:, [1, 2, 3, 5]]).max() < 1e-9


def test_a_sensor_that_reports_wrenches(own):
    lab, _, probe = own
    options = lab["force"]
    time = np.arange(0, 1, 0.002)
    force = np.where(time > 0.5, 2.0, 0.0)[:, None] * [0, 0, 1]
    upside_down = np.broadcast_to(np.diag([1.0, -1.0, -1.0]), (len(time), 3, 3))
    rng = np.random.default_rng(1)
    record = gauge_record(time, force, upside_down, probe, options, rng)
    assert list(record.columns)[:4] == ["time_s", "fx_n", "fy_n", "fz_n"]
    step = record["fz_n"][time > 0.5].mean() - record["fz_n"][time <= 0.5].mean()
    assert step == pytest.approx(-2.0, abs=0.01)
    assert record["fz_n"][time < 0.5].std() == pytest.approx(0.02, rel=0.2)
    del options["wrench"]
    with pytest.raises(ValueError, match="force.wrench: expected its noise"):
        gauge_record(time, force, upside_down, probe, options, rng)
