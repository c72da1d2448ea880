"""From a tracked surface, or a simulated one, to the inverse problem."""

import numpy as np
import pytest
from floor import floor
from palpate.solid.load import contact_pressure, contact_triangle, hertz_contact_radius
from palpate.solid.mesh import quadratic, read_solid, refine_near, solid_mesh
from palpate.surface.tracked import Tracked
from skfem import MeshTet
from thesis.minimise.objective import Objective, Problem, node_sets
from thesis.minimise.options import Load, Minimise, Solid
from thesis.minimise.problem import pose_problem, pose_simulation, pressed_area_modulus
from thesis.minimise.search import minimise_error
from thesis.tracker.simulation import SimulatedSteps

E, NU, FORCE = 25e3, 0.30, np.array([0.0, 0.0, -2.0])
POINT, PRESS = np.array([-0.05, 0.0, 0.0475]), {"indenter_radius_m": 0.00622, "depth_m": 0.006}
SUPPORT = floor(1e-3)
LOAD = set(Load.model_fields)


@pytest.fixture(scope="module")
def tracked(root):
    """Surface of a fine quadratic solid under Hertz's pressure, seen by a camera that is turned."""
    kept = read_solid(root / "config/meshes/foam_block.vtu")
    corners = refine_near(kept, POINT, radius_m=0.015, edge_m=0.0045)
    mesh = quadratic(corners)
    radius = hertz_contact_radius(**PRESS)
    f = contact_pressure(mesh, POINT, [0, 0, -1], FORCE, contact_radius_m=radius)
    sets = node_sets(mesh, SUPPORT, contact_nodes=np.flatnonzero(f.any(axis=1)))
    ones = Problem(mesh, sets, np.ones_like(f), f, 2.0)
    u = Objective(ones, "displacement").displacement(E, NU)
    # Surface nodes with the middles of edges: each triangle of six nodes is cut into four.
    a, b, c, ab, bc, ca = mesh.surface_faces().T
    faces = np.concatenate(
        [np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    )
    nodes, index = np.unique(faces, return_inverse=True)
    pose = np.eye(4)
    pose[:3, :3] = [[1, 0, 0], [0, -0.6, -0.8], [0, 0.8, -0.6]]
    rest = mesh.nodes_m[nodes] @ pose[:3, :3].T
    vertices = np.stack([rest, rest + u[nodes] @ pose[:3, :3].T])
    known = np.ones((2, len(nodes)), bool), pose, np.zeros(2), POINT, 1
    return Tracked(mesh.nodes_m[nodes], index.reshape(-1, 3), rest, vertices, *known)


def posed(root, tracked, **options):
    return pose_problem(
        read_solid(root / "config/meshes/foam_block.vtu"),
        tracked,
        FORCE @ tracked.camera_from_object[:3, :3].T,
        {"range": {"last_frame": 1}, "samples": {"depth_m": [0.0, PRESS["depth_m"]]}},
        SUPPORT,
        indenter_radius_m=PRESS["indenter_radius_m"],
        load=Load.read({k: v for k, v in options.items() if k in LOAD}),
        fineness=Solid.read({k: v for k, v in options.items() if k not in LOAD}),
    )


def recovered(problem):
    found = minimise_error(Objective(problem, "displacement"), (2e4, 0.2), Minimise())
    return found.youngs_modulus_pa, found.poisson_ratio


@pytest.mark.parametrize("rule", ["conserve", "hertz_patch"])
@pytest.mark.parametrize("order", [1, 2])
def test_load_is_turned_and_kept_whole(root, tracked, rule, order):
    problem = posed(root, tracked, element_order=order, force_rule=rule)
    assert np.allclose(problem.force_n.sum(axis=0), FORCE, atol=1e-9)
    loaded = np.flatnonzero(problem.force_n.any(axis=1))
    assert np.array_equal(problem.sets.contact, loaded)


@pytest.mark.long
def test_ten_node_elements_and_pressure_are_right_where_the_study_is_not(root, tracked):
    E_study, nu_study = recovered(posed(root, tracked, element_order=1, force_rule="conserve"))
    E_better, nu_better = recovered(posed(root, tracked, element_order=2, force_rule="hertz_patch"))
    assert abs(E_better / E - 1) < 0.02
    assert abs(nu_better - NU) < 0.01
    assert abs(E_study / E - 1) > 2 * abs(E_better / E - 1)
    assert abs(nu_study - NU) > 2 * abs(nu_better - NU)


def test_the_contact_is_left_out_by_its_radius(root, tracked):
    problem = posed(root, tracked, leave_out_radii=1.5)
    away = np.linalg.norm(problem.mesh.nodes_m - POINT, axis=1)
    near = away[problem.mesh.surface_nodes()] < 1.5 * hertz_contact_radius(**PRESS)
    objective = Objective(problem, "displacement")
    assert len(objective.surface) - len(objective.compared) == np.count_nonzero(near) > 0


@pytest.fixture(scope="module")
def cube():
    grid = MeshTet().refined(2)
    return solid_mesh(0.1 * grid.p.T, grid.t.T)


def test_the_last_step_is_posed_with_the_modulus_of_its_triangles_area(cube):
    triangle = contact_triangle(cube, np.array([0.05, 0.05, 0.1]), largest_distance_m=0.01)
    force, displacement = np.zeros((2, 2, *cube.nodes_m.shape))
    force[1, triangle] = [0.0, 0.6, -0.8]
    displacement[1] = [1e-3, 0, 0] + np.outer(cube.nodes_m[:, 2], [0, 0, -0.02])
    problem = pose_simulation(SimulatedSteps(cube, triangle, force, displacement), SUPPORT)
    known, nodes = problem.displacement_m, cube.surface_nodes()
    assert np.array_equal(known[nodes], displacement[1, nodes])
    assert np.isnan(np.delete(known, nodes, axis=0)).all()
    assert problem.total_force_n == pytest.approx(3.0)
    # Uniform pressure on a circle of its area: 25 mm to two sides go 2 mm down under 3 N.
    area = 0.5 * 0.025**2
    expected = 16 * (3.0 / area) * np.sqrt(area / np.pi) / (3 * np.pi * 0.002)
    assert pressed_area_modulus(problem, triangle) == pytest.approx(expected)


def test_bad_input(root, tracked, cube):
    with pytest.raises(ValueError, match="element_order: expected one of 1, 2, found 3"):
        posed(root, tracked, element_order=3)
    inner = np.setdiff1d(np.arange(len(cube.nodes_m)), cube.surface_nodes())
    below = contact_triangle(cube, np.array([0.05, 0.05, 0]), largest_distance_m=0.01)
    for nodes, height_m, line in (
        (below, -1, "support: expected at least 3 nodes"),
        (inner[:1], 0, f"nodes of the surface, found node {inner[0]} inside"),
        ([], 0, "nodes of the surface, found none"),
        (below, 0, "expected away from the support, found on it"),
    ):
        with pytest.raises(ValueError, match=line):
            node_sets(cube, floor(1e-6, height_m=height_m), contact_nodes=nodes)
