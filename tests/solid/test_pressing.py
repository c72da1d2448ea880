"""Presses of small solids: Hertz's force, balance, mirror symmetry, and what is refused."""

import numpy as np
import pytest
from floor import floor
from palpate.estimate.direct.table import force_table
from palpate.solid.indentation_setup import IndentationOptions, IndentationSetup, indentation_setup
from palpate.solid.indenting import State
from palpate.solid.laws import LAW_NAMES
from palpate.solid.load_steps import drawn_surface, indentation_model, steps
from palpate.solid.mesh import quadratic

RADIUS = 0.02
DOWN = np.array([0.0, 0.0, -1.0])
FLOOR = floor(1e-4)
TOP = np.array([0.05, 0.05, 0.1])
OPTIONS = IndentationOptions(edge_m=0.008, growth=1.0, refine_radius_m=0.05, base_edge_m=0.03)
COARSE = IndentationOptions(edge_m=0.02, growth=1.0, refine_radius_m=0.03, base_edge_m=0.05)
RESTING = floor(1e-4, contact="resting")


def setup_of(mesh, support=FLOOR, point_m=TOP, direction=DOWN, *, options=OPTIONS, **changes):
    given = {"radius_m": RADIUS, "deepest_m": 0.004, "surface": None} | changes
    return indentation_setup(mesh, support, point_m, direction, options=options, **given)


def table_of(mesh, support=FLOOR, *, options=COARSE, **changes):
    known = {"poisson_ratios": (0.1, 0.4), "step_m": 0.0013, "deepest_m": 0.002, "laws": LAW_NAMES}
    given = {"radius_m": RADIUS, "options": options} | known | changes
    return indentation_model(mesh, support, TOP, DOWN, **given)


@pytest.fixture(scope="module")
def bonded(cube):
    """The cube's table to 4 mm by one law."""
    given = {"poisson_ratios": (0.25, 0.3), "step_m": 0.002, "deepest_m": 0.004}
    return table_of(cube, laws=("neo_hookean",), options=OPTIONS, **given)


def test_a_quadratic_field_is_kept_between_the_nodes(cube):
    """A displacement is convex in the distance: on straight lines between nodes it is too large."""
    solid = quadratic(cube)
    drawn, triangles = drawn_surface(solid)
    places = drawn @ solid.nodes_m
    assert drawn @ solid.nodes_m**2 == pytest.approx(places**2, abs=1e-12)
    a, b, c = places[triangles].swapaxes(0, 1)
    assert (np.cross(b, c) * a).sum() / 6 == pytest.approx(solid.volume_m3)
    # Each edge is of two triangles: places of neighbouring faces are one.
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_force_is_hertz_s_and_the_surface_goes_as_deep_as_the_sphere(bonded):
    depth = bonded.depth_m[3:]
    hertz = 4 / 3 / (1 - 0.3**2) * np.sqrt(RADIUS) * depth**1.5
    ratio = bonded.force_per_modulus_m2[0, 1, 3:] / hertz
    # A layer five spheres thick is a little stiffer, finite strain a little softer.
    assert ratio == pytest.approx(1.03, abs=0.06)
    assert (np.diff(bonded.force_per_modulus_m2, axis=-1) > 0).all()
    assert (bonded.force_per_modulus_m2[..., 0] == 0).all()
    top = np.argmin(np.linalg.norm(bonded.surface_rest_m - TOP, axis=1))
    moved = bonded.surface_displacement_m[0, 1, 3:, top] @ DOWN
    assert moved == pytest.approx(bonded.depth_m[3:], rel=0.05)
    bottom = bonded.surface_rest_m[:, 2] == 0
    assert (bonded.surface_displacement_m[..., bottom, :] == 0).all()


def test_between_the_ratios_that_a_law_is_solved_at_it_parts_evenly_from_the_first(coarse):
    model = table_of(coarse, poisson_ratios=(0.1, 0.25, 0.4))
    first, second = model.force_per_modulus_m2[..., 1:]
    harder = second / first
    # Blatz and Ko's foam: by 4 to 10 % on this coarse mesh.
    assert (harder[:, -1] > 1.02).all()
    assert harder[1] == pytest.approx(np.sqrt(harder[0] * harder[2]))
    apart = np.diff(model.surface_displacement_m, axis=0)[0]
    assert apart[1] == pytest.approx((apart[0] + apart[2]) / 2, abs=1e-8)
    assert np.abs(apart).max() > 1e-5


def test_load_steps_that_end_early_give_a_table_that_ends_there(coarse, monkeypatch, caplog):
    """For one Poisson's ratio there is no equilibrium beyond 2.4 mm: the table is no deeper."""
    whole = IndentationSetup.pressed

    def model():
        return table_of(coarse, step_m=0.001, deepest_m=0.004, laws=("neo_hookean",))

    def pressed(self, law, nu):
        found = whole(self, law, nu)
        equilibrium = found.equilibrium

        def ends(start_m, depth_m, *, last):
            if depth_m > 0.0024:
                raise ValueError("equilibrium: expected one, found none")
            return equilibrium(start_m, depth_m, last=last)

        if nu == 0.4:
            found.equilibrium = ends
        return found

    complete = model()
    monkeypatch.setattr(IndentationSetup, "pressed", pressed)
    short = model()
    count = int((complete.depth_m < 0.0024).sum())
    assert 5 <= count < len(complete.depth_m)
    assert np.array_equal(short.depth_m, complete.depth_m[:count])
    for name in ("force_per_modulus_m2", "surface_displacement_m"):
        known = getattr(complete, name)[:, :, :count]
        assert getattr(short, name) == pytest.approx(known, rel=1e-6, abs=1e-12)
    missed_mm = 1e3 * complete.depth_m[count]
    assert f"Poisson's ratio 0.4: load steps end before {missed_mm:.3g} mm" in caplog.text


def test_resting_solid_bears_the_force_on_its_table(cube):
    setup = setup_of(cube, RESTING)
    pressed = setup.pressed("neo_hookean", 0.3)
    rest = State.at_rest(setup.moved.nodes_m)
    state = pressed.equilibrium(setup.first_start(0.001), 0.001, last=rest)
    table = -pressed.table.forces(state.x_m).sum(axis=0)
    assert table[2] == pytest.approx(-state.force_m2[2], rel=5e-3)
    assert np.abs(table[:2]).max() < 1e-2 * table[2]
    hertz = 4 / 3 / (1 - 0.3**2) * np.sqrt(RADIUS) * 0.001**1.5
    assert 0.85 < state.force_m2 @ DOWN / hertz < 1.05


def test_an_equilibrium_does_not_depend_on_the_load_steps(coarse):
    """Long steps are halved or begun from where another material went; what is found is one."""
    setup = setup_of(coarse, RESTING, deepest_m=0.006, options=COARSE)
    few, many = np.array([0.0, 0.001, 0.006]), np.array([0.0, 0.001, 0.002, 0.004, 0.006])
    slow = steps(setup, "neo_hookean", 0.3, many, [None, None])
    other = steps(setup, "neo_hookean", 0.4, many, [slow, None])
    led = steps(setup, "neo_hookean", 0.3, many, [other, slow])
    fast = steps(setup, "neo_hookean", 0.3, few, [None, None])
    assert [len(found) for found in (slow, other, led, fast)] == [5, 5, 5, 3]
    assert other[-1].force_m2[2] != pytest.approx(slow[-1].force_m2[2], rel=0.01)
    for found in (led, fast):
        assert found[-1].force_m2 @ DOWN == pytest.approx(slow[-1].force_m2 @ DOWN, rel=2e-3)


def test_a_broad_base_is_solved_once_more_and_slides(coarse):
    """A cube on a base twice as wide as what counts as broad: softer where nothing sticks."""
    model = table_of(coarse, RESTING)
    assert model.laws == (*LAW_NAMES, "neo_hookean, sliding")
    stuck, _, slid = model.force_per_modulus_m2[..., -1]
    assert ((0.9 < slid / stuck) & (slid / stuck < 0.999)).all()
    bottom = model.surface_rest_m[:, 2] == 0
    crept = np.linalg.norm(model.surface_displacement_m[:, 1, -1, bottom, :2], axis=-1).max(axis=1)
    assert crept[2] > 10 * crept[0]
    table = force_table(model)
    assert table.softer is not None
    assert table.force(0.002, 0.4, 0.0) == pytest.approx(np.sqrt(slid * stuck)[1], rel=1e-6)


def test_bad_input(cube):
    with pytest.raises(ValueError, match="direction: expected one with a length"):
        setup_of(cube, direction=np.zeros(3))
    with pytest.raises(ValueError, match="point_m: expected a line through the solid"):
        setup_of(cube, point_m=TOP + [0.3, 0, 0])
