"""Finite strain in ten-node elements, and what their surface touches: derivatives."""

import numpy as np
import pytest
from palpate.solid.hyperelastic import HyperelasticSolid
from palpate.solid.laws import LAWS, named_law, unit_lame
from palpate.solid.mesh import quadratic
from palpate.solid.obstacle import PENALTY_PER_M
from palpate.solid.resting import standing_table
from palpate.solid.stiffness import combined, elastic_stiffness
from palpate.solid.support import Support


@pytest.fixture(scope="module")
def mesh(cube):
    return quadratic(cube)


@pytest.fixture(scope="module")
def bent(mesh):
    x = mesh.nodes_m / 0.1
    bend = np.column_stack(
        [0.15 * x[:, 2] ** 2, 0.1 * np.sin(2 * x[:, 0]), -0.1 * x[:, 2] * x[:, 1]]
    )
    return mesh.nodes_m + 0.1 * bend


@pytest.mark.parametrize("name", sorted(LAWS))
def test_forces_and_blocks_are_slopes(mesh, bent, name):
    solid = HyperelasticSolid(mesh, named_law(name), 0.3)
    step = 1e-7 * np.random.default_rng(1).normal(size=bent.shape)
    slope = (solid.energy(bent + step) - solid.energy(bent - step)) / 2
    assert (solid.forces(bent) * step).sum() == pytest.approx(slope, rel=1e-5)
    change = solid.forces(bent + step) - solid.forces(bent - step)
    K = solid.pattern.matrix(solid.blocks(bent))
    found = (K @ (2 * step).ravel()).reshape(-1, 3)
    assert np.linalg.norm(found - change) < 1e-5 * np.linalg.norm(change)


def test_at_rest_it_is_the_linear_solid_and_flat_elements_have_no_finite_energy(mesh):
    solid = HyperelasticSolid(mesh, named_law("neo_hookean"), 0.3)
    K = solid.pattern.matrix(solid.blocks(mesh.nodes_m))
    linear = combined(*elastic_stiffness(mesh), *unit_lame(0.3))
    assert abs(K - linear).max() < 1e-12 * abs(linear).max()
    solid = HyperelasticSolid(mesh, named_law("blatz_ko"), 0.3)
    assert solid.energy(mesh.nodes_m * [1, 1, 0.01]) == np.inf
    assert solid.least_volume(mesh.nodes_m * [1, 1, 0.5]) == pytest.approx(0.5)


def test_positive_part_has_no_negative_direction(mesh):
    solid = HyperelasticSolid(mesh, named_law("neo_hookean"), 0.3)
    squeezed = mesh.nodes_m * [1, 1, 0.4]
    least = []
    for positive in (False, True):
        blocks = solid.blocks(squeezed, positive=positive)
        K = solid.pattern.matrix(blocks).toarray()
        least.append(np.linalg.eigvalsh(K)[0] / abs(K).max())
    assert least[0] < -1e-3
    assert least[1] > -1e-10


def test_what_touches_the_table_sticks(mesh):
    support = Support(np.zeros(3), np.array([0.0, 0, 2]), 1e-3)
    touch = np.array([0.05, 0.05, 0.1])
    table = standing_table(mesh, support, touch, reach_m=0.01)
    down = mesh.nodes_m - [0, 0, 1e-4]
    assert np.isnan(table.anchors_m).all()
    lifted = table.forces(mesh.nodes_m + [0, 0, 1e-3])
    assert np.flatnonzero(lifted.any(axis=1)).size == 0
    pressed = table.forces(down).sum(axis=0)
    assert pressed == pytest.approx([0, 0, -PENALTY_PER_M * 1e-4 * 0.1**2], abs=1e-12)
    table.settle(down)
    aside = down + [2e-5, 0, 0]
    held = np.einsum("pab,pb->a", table.pins_m, (aside - mesh.nodes_m)[table.pinned])
    shear = (table.forces(aside).sum(axis=0) - held)[0]
    assert shear == pytest.approx(PENALTY_PER_M * 2e-5 * 0.1**2, rel=1e-9)
    step = 1e-7 * np.random.default_rng(3).normal(size=down.shape)
    slope = (table.energy(aside + step) - table.energy(aside - step)) / 2
    assert (table.forces(aside) * step).sum() == pytest.approx(slope, rel=1e-6)


def test_what_stands_is_held_sideways_on_the_line_of_the_press_and_against_spinning(mesh):
    support = Support(np.zeros(3), np.array([0.0, 0, 2]), 1e-3)
    touch = np.array([0.06, 0.05, 0.1])
    table = standing_table(mesh, support, touch, reach_m=0.01)
    *line, far = mesh.nodes_m[table.pinned]
    assert np.linalg.norm(line - np.array([[0.06, 0.05, 0.065], [0.06, 0.05, 0.035]]), axis=1) == (
        pytest.approx(0, abs=0.01)
    )
    beside = far - touch
    assert np.hypot(*beside[:2]) == pytest.approx(np.hypot(0.06, 0.05))
    around = np.array([-beside[1], beside[0], 0]) / np.hypot(*beside[:2])
    assert table.pins_m[0] == pytest.approx(np.diag([1.0, 1, 0]))
    assert table.pins_m[1] == pytest.approx(np.diag([1.0, 1, 0]))
    assert table.pins_m[2] == pytest.approx(np.outer(around, around))
