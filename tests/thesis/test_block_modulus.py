"""The inverse problem of a block that is loaded on a triangle."""

from types import SimpleNamespace

import numpy as np
import pytest
from floor import floor
from palpate.solid.load import contact_triangle
from palpate.solid.mesh import solid_mesh
from palpate.surface.simulation import SimulatedSteps
from skfem import MeshTet
from thesis.minimise.simulation import pose_simulation, pressed_area_modulus


@pytest.fixture(scope="module")
def steps():
    cube = MeshTet().refined(2)
    mesh = solid_mesh(0.1 * cube.p.T, cube.t.T)
    triangle = contact_triangle(mesh, np.array([0.05, 0.05, 0.1]), largest_distance_m=0.01)
    force, moved = np.zeros((2, 2, *mesh.nodes_m.shape))
    force[1, triangle] = [0.0, 0.6, -0.8]
    moved[1] = [1e-3, 0, 0] + np.outer(mesh.nodes_m[:, 2], [0, 0, -0.02])
    return SimulatedSteps(mesh, triangle, force, moved)


def test_the_last_step_is_posed(steps):
    problem, nodes = pose_simulation(steps, floor(1e-6)), steps.mesh.surface_nodes()
    known = problem.measurement.displacement_m
    assert np.array_equal(known[nodes], steps.displacement_m[1, nodes])
    assert np.isnan(np.delete(known, nodes, axis=0)).all()
    assert problem.measurement.total_force_n == pytest.approx(3.0)
    rest = steps.mesh.nodes_m[nodes]
    frames = np.stack([rest + 0.5, rest + 0.7, rest + [0.5, 0.5, 0.6]])
    tracked = SimpleNamespace(template_m=rest, vertices_m=frames)
    known = pose_simulation(steps, floor(1e-6), tracked=tracked).measurement.displacement_m
    assert known[nodes] == pytest.approx(np.tile([0, 0, 0.1], (len(nodes), 1)), abs=1e-12)


def test_modulus_of_uniform_pressure_on_a_circle_of_the_triangles_area(steps):
    """An edge of 25 mm to two sides: 312.5 mm^2 go 2 mm down under 3 N."""
    problem = pose_simulation(steps, floor(1e-6))
    area = 0.5 * 0.025**2
    expected = 16 * (3.0 / area) * np.sqrt(area / np.pi) / (3 * np.pi * 0.002)
    assert pressed_area_modulus(problem, steps.triangle) == pytest.approx(expected)
