"""From a tracked surface to the inverse problem: elements and loads, against a finer solid."""

import numpy as np
import pytest
from floor import floor
from indented_block import MINIMISE as OPTIONS
from palpate.solid.laws import lame_from_engineering
from palpate.solid.load import contact_pressure, hertz_contact_radius
from palpate.solid.mesh import quadratic, read_solid, refine_near
from palpate.surface.tracked import Tracked
from thesis.minimise.objective import Measurement, Objective, node_sets
from thesis.minimise.options import Load, Solid
from thesis.minimise.problem import pose_problem
from thesis.minimise.reduced_objective import ReducedObjective
from thesis.minimise.search import minimise_error

E, NU, FORCE = 25e3, 0.30, np.array([0.0, 0.0, -2.0])
POINT, PRESS = np.array([-0.05, 0.0, 0.0475]), {"indenter_radius_m": 0.00622, "depth_m": 0.006}
SUPPORT = floor(1e-3)
COARSE = {"refine_radius_m": 0.02, "refine_edge_m": 0.007}
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
    ones = Measurement(np.ones_like(f), f, 2.0)
    u = Objective(mesh, sets, ones, option="displacement").displacement(
        *lame_from_engineering(E, NU)
    )
    # Surface nodes with the middles of edges: each triangle of six nodes is cut into four.
    a, b, c, ab, bc, ca = mesh.surface_faces().T
    faces = np.concatenate(
        [np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    )
    nodes, index = np.unique(faces, return_inverse=True)
    pose = np.eye(4)
    pose[:3, :3] = [[1, 0, 0], [0, -0.6, -0.8], [0, 0.8, -0.6]]
    rest = mesh.nodes_m[nodes] @ pose[:3, :3].T
    return Tracked(
        template_m=mesh.nodes_m[nodes],
        faces=index.reshape(-1, 3),
        rest_m=rest,
        vertices_m=np.stack([rest, rest + u[nodes] @ pose[:3, :3].T]),
        observed=np.ones((2, len(nodes)), bool),
        camera_from_object=pose,
        residual_m=np.zeros(2),
        contact_point_m=POINT,
        contact_frame=1,
    )


def posed(root, tracked, **options):
    return pose_problem(
        read_solid(root / "config/meshes/foam_block.vtu"),
        tracked,
        FORCE @ tracked.camera_from_object[:3, :3].T,
        1,
        PRESS["depth_m"],
        SUPPORT,
        indenter_radius_m=PRESS["indenter_radius_m"],
        load=Load.read({k: v for k, v in options.items() if k in LOAD}),
        fineness=Solid.read({k: v for k, v in options.items() if k not in LOAD}),
    )


def recovered(problem):
    full = problem.objective("displacement")
    found = minimise_error(ReducedObjective(full), (2e4, 0.2), OPTIONS)
    return found.youngs_modulus_pa, found.poisson_ratio


@pytest.mark.parametrize("rule", ["conserve", "hertz_patch"])
@pytest.mark.parametrize("order", [1, 2])
def test_load_is_turned_and_kept_whole(root, tracked, rule, order):
    problem = posed(root, tracked, element_order=order, force_rule=rule)
    assert problem.mesh.order == order
    assert np.allclose(problem.measurement.force_n.sum(axis=0), FORCE, atol=1e-9)
    loaded = np.flatnonzero(problem.measurement.force_n.any(axis=1))
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
    options = {"element_order": 1, "force_rule": "conserve"}
    problem = posed(root, tracked, leave_out_radii=1.5, **options)
    away = np.linalg.norm(problem.mesh.nodes_m - POINT, axis=1)
    radius = hertz_contact_radius(**PRESS)
    assert (
        0
        < len(problem.left_out)
        == np.count_nonzero(away[problem.mesh.surface_nodes()] < 1.5 * radius)
    )
    assert posed(root, tracked, **options).left_out is None


def test_bad_input(root, tracked):
    with pytest.raises(ValueError, match="element_order: expected one of 1, 2, found 3"):
        posed(root, tracked, element_order=3, force_rule="conserve")
    with pytest.raises(ValueError, match="force_rule: expected one of area_ratio, conserve"):
        posed(root, tracked, element_order=1, force_rule="all")
