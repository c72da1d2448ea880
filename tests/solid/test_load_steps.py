"""Where load steps start, how they are halved, and what of a solid is pressed how far."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from palpate.solid.indenting import State
from palpate.solid.load_steps import CUTS, LEAST_START, _start, _step, solved_ratios, steps
from palpate.solid.mesh import solid_mesh
from palpate.solid.obstacle import first_touch, thickness_m
from palpate.solid.smooth_surface import _corner_weights, corner_normals
from skfem import MeshTet

DEPTHS = np.array([0.0, 1.0, 3.0, 4.0])


def state(x):
    return State(np.array([[0.0, 0, x]]), np.array([0.0, 0, -x]), 0.0, 0.0, 1)


class Stiff:
    """A made-up solid of one node that finds no equilibrium farther than a limit from the last."""

    def __init__(self, limit, volume=1.0):
        self.limit, self.volume, self.asked = limit, volume, []
        self.solid = SimpleNamespace(least_volume=lambda x: self.volume)

    def equilibrium(self, start, depth, *, last):
        self.asked.append((depth, float(start[0, 2]), float(last.x_m[0, 2])))
        if depth - last.x_m[0, 2] > self.limit:
            raise ValueError("no equilibrium")
        return state(depth)


def test_a_step_that_is_found_at_once():
    solid = Stiff(1.0)
    assert _step(solid, state(2.0), np.array([[0, 0, 2.9]]), 2.0, 3.0, CUTS).x_m[0, 2] == 3.0
    assert solid.asked == [(3.0, 2.9, 2.0)]


def test_a_step_is_halved_and_goes_on_as_it_began():
    solid = Stiff(0.5)
    found = _step(solid, state(2.0), np.array([[0, 0, 2.9]]), 2.0, 3.0, CUTS)
    assert found.x_m[0, 2] == 3.0
    # Half of it from where the last ended, the rest from as far beyond the middle.
    assert solid.asked == [(3.0, 2.9, 2.0), (2.5, 2.0, 2.0), (3.0, 3.0, 2.5)]
    with pytest.raises(ValueError, match="no equilibrium"):
        _step(Stiff(0.1), state(2.0), np.array([[0, 0, 2.9]]), 2.0, 3.0, CUTS)
    assert _step(Stiff(0.126), state(2.0), np.zeros((1, 3)), 2.0, 3.0, CUTS).x_m[0, 2] == 3.0


def test_a_start_that_squeezes_an_element_is_not_taken():
    for volume, start in ((0.9 * LEAST_START, 2.0), (1.1 * LEAST_START, 2.9)):
        solid = Stiff(1.0, volume)
        _step(solid, state(2.0), np.array([[0, 0, 2.9]]), 2.0, 3.0, CUTS)
        assert solid.asked[0][1] == start


def test_guesses_of_the_next_step():
    setup = SimpleNamespace(first_start=lambda depth: np.full((1, 3), depth))
    first = [state(x) for x in (0.0, 10.0, 16.0, 18.0)]
    second = [state(x) for x in (0.0, 9.0, 14.0, 15.0)]
    states = [state(0.0)]
    assert _start(setup, states, DEPTHS, [None, None])[0, 2] == 1.0
    assert _start(setup, states, DEPTHS, [first, None])[0, 2] == 10.0
    # As the nearest goes on, and as much more as it does over the next.
    assert _start(setup, states, DEPTHS, [first, second])[0, 2] == 2 * 10 - 9
    states += [state(8.0)]
    assert _start(setup, states, DEPTHS, [first, second])[0, 2] == 8 + 2 * 6 - 5
    # Straight on, over twice the way.
    assert _start(setup, states, DEPTHS, [first[:2], None])[0, 2] == 8 + 2 * 8
    assert _start(setup, states, DEPTHS, [None, second])[0, 2] == 8 + 2 * 8


def test_steps_end_where_there_is_no_equilibrium(caplog):
    class Ends(Stiff):
        def equilibrium(self, start, depth, *, last):
            if depth > 3.5:
                raise ValueError("no equilibrium")
            return super().equilibrium(start, depth, last=last)

    setup = SimpleNamespace(
        pressed=lambda law, nu: Ends(10.0),
        moved=SimpleNamespace(nodes_m=np.zeros((1, 3))),
        first_start=lambda depth: np.zeros((1, 3)),
        direction=np.array([0.0, 0, -1]),
    )
    found = steps(setup, "neo_hookean", 0.3, DEPTHS / 1000, [None, None])
    assert [one.x_m[0, 2] for one in found] == pytest.approx(DEPTHS / 1000)
    found = steps(setup, "neo_hookean", 0.3, DEPTHS, [None, None])
    assert [one.x_m[0, 2] for one in found] == [0.0, 1.0, 3.0]
    assert "load steps end before 4e+03 mm" in caplog.text


def test_which_ratios_are_solved():
    assert solved_ratios(True, 4) == [0, 1, 2, 3]
    assert solved_ratios(False, 4) == [0, 3] and solved_ratios(False, 1) == [0]


@pytest.fixture(scope="module")
def cube():
    mesh = MeshTet().refined(3)
    return solid_mesh(0.1 * mesh.p.T, mesh.t.T)


def test_way_through_a_cube(cube):
    top, slanted = np.array([0.052, 0.053, 0.1]), np.array([0.6, 0, -0.8])
    assert thickness_m(cube, top, np.array([0, 0, -1.0])) == pytest.approx(0.1)
    # Out at the side, 48 mm on.
    assert thickness_m(cube, top, slanted) == pytest.approx(0.048 / 0.6)
    assert thickness_m(cube, top - 0.01 * slanted, slanted) == pytest.approx(0.048 / 0.6)


def test_of_two_parts_the_nearer_is_gone_through():
    """Two plates, 10 and 20 mm thick, with 30 mm between them."""
    mesh = MeshTet().refined(1)
    unit = mesh.p.T
    low, high = unit * [0.1, 0.1, 0.02], unit * [0.1, 0.1, 0.01] + [0, 0, 0.05]
    plates = solid_mesh(np.vstack([low, high]), np.vstack([mesh.t.T, mesh.t.T + len(unit)]))
    down = np.array([0.0, 0, -1])
    for height, thickness in ((0.062, 0.01), (0.018, 0.02), (0.024, 0.02)):
        point = np.array([0.052, 0.043, height])
        assert thickness_m(plates, point, down) == pytest.approx(thickness)


@pytest.mark.parametrize("above", [-0.004, 0.0, 0.007])
def test_first_touch_of_a_flat_side(cube, above):
    faces = cube.surface_faces()
    faces = faces[(cube.nodes_m[faces][..., 2] == 0.1).all(axis=1)]
    point = np.array([0.05, 0.05, 0.1 + above])
    down = np.array([0.0, 0, -1])
    assert first_touch(cube.nodes_m, faces, point, down, radius_m=0.02) == pytest.approx(above)
    with pytest.raises(ValueError, match="a surface under the sphere's way, found none"):
        first_touch(cube.nodes_m, faces, point + [0.2, 0, 0], down, radius_m=0.02)


def test_normals_are_exact_on_spheres_and_keep_creases():
    ball = trimesh.creation.icosphere(2, radius=0.06)
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    assert corner_normals(vertices, faces) == pytest.approx(vertices[faces] / 0.06, abs=1e-10)
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    found = corner_normals(np.array(box.vertices), np.array(box.faces))
    assert found == pytest.approx(np.repeat(box.face_normals[:, None], 3, axis=1))
    # Of a corner with sides of 1 and 2 at a right angle: sin / (1 * 2).
    triangle = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 2, 0]]])
    assert _corner_weights(triangle)[0] == pytest.approx([2 / 4, 2 / 5, 2 / 20])
