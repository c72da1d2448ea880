"""The inverse problem: how it is posed, its objective and search, what the moduli are worth."""

from dataclasses import replace

import numpy as np
import pytest
from floor import floor
from palpate.solid.laws import engineering_from_lame, reduced_modulus
from palpate.solid.load import contact_pressure, contact_triangle, hertz_contact_radius, nodal_force
from palpate.solid.mesh import quadratic, read_solid, refine_near, solid_mesh
from palpate.surface.tracked import Tracked
from scipy.spatial.distance import cdist
from skfem import MeshTet
from thesis.minimise.fit import Valley, fit_moduli, poisson_profile
from thesis.minimise.objective import Objective, Problem, node_sets
from thesis.minimise.options import Load, Minimise, Solid
from thesis.minimise.problem import pose_problem
from thesis.minimise.search import minimise_error

# Section 3.3.2: the study's simulated block.
TRUE = engineering_from_lame(80685.0, 8965.0)
NUS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.45, 0.48, 0.499)
OPTIONS = Minimise(iterations=200, profile_poisson_ratios=NUS)
PLACES = [(1e4, 0.0), (2e4, 0.13), (3e4, 0.3), (26e3, 0.45), (2e4, 0.498)]
BOTH = ["displacement", "force_displacement"]


def indented_block(mesh, point_m):
    """Indent a mesh that stands on z = 0 with 2 N at a point; exact at the true moduli."""
    triangle = contact_triangle(mesh, np.array(point_m), largest_distance_m=0.03)
    force, sphere = np.array([0.0, 0.0, -2.0]), {"indenter_radius_m": 0.00622, "depth_m": 0.008}
    forces = nodal_force(mesh, triangle, force, rule="conserve", turn_to_normal=True, **sphere)
    sets = node_sets(mesh, floor(1e-3), contact_nodes=triangle)
    blank = Problem(mesh, sets, np.ones_like(forces), forces, 2.0)
    u = Objective(blank, "displacement").displacement(*TRUE)
    u[sets.interior] = np.nan
    return moved(blank, u - 1)


def moved(problem, error_m):
    """The same with an error of each node's displacement."""
    return replace(problem, displacement_m=problem.displacement_m + error_m)


def noise(problem, std_m, seed, length_m=0.0):
    """Normal noise (n, 3) [m] whose correlation falls as exp(-distance / length)."""
    nodes = problem.mesh.nodes_m
    drawn = np.random.default_rng(seed).normal(0, std_m, nodes.shape)
    if not length_m:
        return drawn
    return np.linalg.cholesky(np.exp(-cdist(nodes, nodes) / length_m)) @ drawn


@pytest.fixture(scope="module")
def exact(root):
    """Block with the displacement that an indentation causes at the true moduli."""
    return indented_block(read_solid(root / "config/meshes/foam_block.vtu"), [-0.05, 0, 0.0475])


@pytest.fixture(scope="module")
def noisy(exact):
    return moved(exact, noise(exact, 1e-4, 5))


@pytest.mark.parametrize("option", BOTH)
def test_the_error_is_that_of_whole_solutions(exact, noisy, option):
    grid = MeshTet.init_tensor(*(np.linspace(0, 0.1, n) for n in (2, 3, 3)))
    hollow = indented_block(solid_mesh(grid.p.T, grid.t.T), [0.05, 0.05, 0.1])
    assert not len(hollow.sets.interior)
    out = np.concatenate([noisy.sets.contact, noisy.sets.free[:20]])
    for problem in (hollow, noisy, replace(noisy, left_out=out)):
        objective = Objective(problem, option)
        for place in PLACES:
            assert objective(*place) == pytest.approx(objective.full(*place), rel=1e-6)
        assert objective(2e4, -0.2) == objective.full(2e4, -0.2)
    assert Objective(exact, option)(*TRUE) < 1e-9 < 1e-7 < Objective(exact, option)(2e4, 0.45)


@pytest.mark.parametrize("option", BOTH)
def test_every_search_finds_the_truth(exact, option):
    found = fit_moduli(Objective(exact, option), 1.3 * reduced_modulus(*TRUE), OPTIONS)
    minimum = found.minimum
    assert (minimum.youngs_modulus_pa, minimum.poisson_ratio) == pytest.approx(TRUE, rel=1e-4)
    assert minimum.converged and not minimum.at_bound
    assert all(np.diff([step["error_m"] for step in minimum.trace]) <= 0)
    for best in found.least_squares.values():
        assert (best.youngs_modulus_pa, best.poisson_ratio) == pytest.approx(TRUE, rel=1e-6)
    assert found.profile.verdict == ("identified" if option == BOTH[0] else "not judged")
    assert found.reduced_model_error < 1e-6


@pytest.mark.parametrize("option", BOTH)
def test_the_valley_ends_where_nelder_mead_does(noisy, option):
    objective = Objective(noisy, option)
    simplex = minimise_error(objective, (2e4, 0.3), OPTIONS)
    best = Valley(objective, OPTIONS, "length").best()
    assert best.youngs_modulus_pa == pytest.approx(simplex.youngs_modulus_pa, rel=1e-4)
    assert best.poisson_ratio == pytest.approx(simplex.poisson_ratio, abs=1e-4)


def bowl(E, nu):
    return abs(np.log(E / 25e3)) + abs(nu - 0.3)


def test_searches_come_away_from_bounds_and_stay_with_real_solids(exact):
    """Also in the printed parameters, from where there is no lambda or towards what is none."""
    lame = OPTIONS.changed(parametrisation="lame", iterations=400)
    for start, options in (((100.0, 0.499), OPTIONS), ((1e8, 0.0), OPTIONS), ((2e4, 0.0), lame)):
        found = minimise_error(bowl, start, options)
        assert found.youngs_modulus_pa == pytest.approx(25e3, rel=1e-3)
        assert found.poisson_ratio == pytest.approx(0.3, abs=1e-3)
        assert not found.at_bound
    found = minimise_error(Objective(exact, BOTH[0]), (33000.0, 0.4), lame)
    assert found.youngs_modulus_pa == pytest.approx(TRUE[0], rel=1e-3)
    astray = minimise_error(lambda E, nu: E**2 + (nu + 2) ** 2, (2e4, 0.3), lame)
    assert astray.lame_mu_pa > 0 and astray.at_bound


def valley_of(problem, norm="length", option="displacement"):
    valley = Valley(Objective(problem, option), OPTIONS, norm)
    best = valley.best()
    return best, poisson_profile(valley, best)


@pytest.mark.long
@pytest.mark.parametrize("norm", ["length", "square"])
def test_standard_errors_are_those_of_repeated_noise(exact, norm):
    found = [valley_of(moved(exact, noise(exact, 3e-5, seed)), norm)[0] for seed in range(40)]
    logs = [np.log(f.youngs_modulus_pa) for f in found]
    log_stds = [f.youngs_modulus_std_pa / f.youngs_modulus_pa for f in found]
    # A deviation of 40 draws is itself known to 11 %.
    assert np.mean(log_stds) / np.std(logs, ddof=1) == pytest.approx(1, abs=0.3)
    nus, stds = [f.poisson_ratio for f in found], [f.poisson_ratio_std for f in found]
    assert np.mean(stds) / np.std(nus, ddof=1) == pytest.approx(1, abs=0.3)


@pytest.mark.parametrize(
    ("length_m", "count", "least"),
    [(0.0, 20, 0.85), pytest.param(0.02, 15, 0.7, marks=pytest.mark.long)],
)
def test_intervals_of_nu_cover_it(exact, length_m, count, least):
    """With correlated gaps few patches make standard errors small: four of five."""
    drawn = [moved(exact, noise(exact, 3e-5, seed, length_m)) for seed in range(20)]
    intervals = [valley_of(problem)[1].interval for problem in drawn]
    judged = [interval for interval in intervals if interval is not None]
    assert len(judged) >= count
    assert np.mean([low <= TRUE[1] <= high for low, high in judged]) >= least


def test_what_noise_leaves_of_nu(exact):
    """Little of it identifies nu; much, an offset of all gaps, or a bound do not."""
    best, profile = valley_of(moved(exact, noise(exact, 2e-5, 5)))
    assert profile.verdict == "identified"
    assert profile.interval[0] < best.poisson_ratio < profile.interval[1]
    assert best.error_m == min(profile.errors_m) < profile.errors_m[0]
    assert best.patch_m == pytest.approx(0.02)
    assert valley_of(moved(exact, noise(exact, 3e-5, 0, 0.02)))[0].patch_m > 0.04
    assert valley_of(moved(exact, noise(exact, 2e-3, 7)))[1].verdict == "not identified"
    best, profile = valley_of(moved(exact, np.tile([0, 0, 3e-4], (len(exact.mesh.nodes_m), 1))))
    assert (best.unknown, profile.verdict) == ("gaps agree over the surface", "not identified")
    best, _ = valley_of(moved(exact, noise(exact, 2e-3, 6)))
    assert (best.at_bound, best.poisson_ratio_std, best.unknown) == (True, None, "at a bound")


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
    solid = read_solid(root / "config/meshes/foam_block.vtu")
    hertz = {"range": {"last_frame": 1}, "samples": {"depth_m": [0.0, PRESS["depth_m"]]}}
    force = FORCE @ tracked.camera_from_object[:3, :3].T
    more = {"indenter_radius_m": PRESS["indenter_radius_m"]}
    more["load"] = Load.read({k: v for k, v in options.items() if k in LOAD})
    more["fineness"] = Solid.read({k: v for k, v in options.items() if k not in LOAD})
    return pose_problem(solid, tracked, force, hertz, SUPPORT, **more)


@pytest.mark.parametrize("rule", ["conserve", "hertz_patch"])
@pytest.mark.parametrize("order", [1, 2])
def test_load_is_turned_and_kept_whole(root, tracked, rule, order):
    problem = posed(root, tracked, element_order=order, force_rule=rule)
    assert np.allclose(problem.force_n.sum(axis=0), FORCE, atol=1e-9)
    loaded = np.flatnonzero(problem.force_n.any(axis=1))
    assert np.array_equal(problem.sets.contact, loaded)


@pytest.mark.long
def test_ten_node_elements_and_pressure_are_right_where_the_study_is_not(root, tracked):
    off = []
    for order, rule in ((1, "conserve"), (2, "hertz_patch")):
        problem = posed(root, tracked, element_order=order, force_rule=rule)
        found = minimise_error(Objective(problem, "displacement"), (2e4, 0.2), Minimise())
        off.append(np.abs([found.youngs_modulus_pa / E - 1, found.poisson_ratio - NU]))
    study, better = off
    assert (better < [0.02, 0.01]).all() and (study > 2 * better).all()


def test_the_contact_is_left_out_by_its_radius(root, tracked):
    problem = posed(root, tracked, leave_out_radii=1.5)
    away = np.linalg.norm(problem.mesh.nodes_m - POINT, axis=1)
    near = away[problem.mesh.surface_nodes()] < 1.5 * hertz_contact_radius(**PRESS)
    objective = Objective(problem, "displacement")
    assert len(objective.surface) - len(objective.compared) == np.count_nonzero(near) > 0
