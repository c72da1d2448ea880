"""Rows of the bench about the search for the moduli: reduced models against plain solves."""

import time

import numpy as np
from floor import floor
from full_solves import largest_error
from palpate.estimate.minimise.least_squares import fit_least_squares
from palpate.estimate.minimise.objective import Measurement, Objective
from palpate.estimate.minimise.reduced_objective import ReducedObjective
from palpate.estimate.minimise.scatter import NORMS
from palpate.estimate.minimise.search import hertz_start, minimise_error
from palpate.solid.boundary import node_sets
from palpate.solid.load import contact_triangle, nodal_force
from palpate.solid.mesh import solid_mesh
from palpate.solid.moduli import lame_from_engineering, reduced_modulus
from palpate.solid.stiffness import combined, elastic_stiffness
from scipy.sparse.linalg import spsolve
from skfem import Basis, ElementTetP1, ElementVector, MeshTet
from skfem.models.elasticity import linear_elasticity

# Points along length, width and height of the study's block: about 650, 1200 and 3000 nodes.
GRIDS = {648: (18, 9, 4), 1250: (25, 10, 5), 3024: (36, 12, 7)}
SIZE_M = (0.598, 0.150, 0.0475)
TRUE = lame_from_engineering(25998.5, 0.45)
NOISE_M = 3e-5
BOUNDS = {"youngs_modulus_bounds_pa": (100.0, 1e8), "poisson_ratio_bounds": (0.0, 0.499)}
SEARCH = BOUNDS | {"parametrisation": "modulus", "iterations": 100}
STARTS = [round(0.05 * k, 2) for k in range(1, 10)]


class PlainObjective:
    """Eq. 3.31 as one would first write it: assembled and solved anew for each (lam, mu)."""

    def __init__(self, mesh, full: Objective) -> None:
        self.mesh, self.full, self.option = mesh, full, full.option

    def stiffness(self, lam, mu):
        """Assemble K anew, by the faster of the two assemblies at hand."""
        return combined(*elastic_stiffness(self.mesh), lam, mu)

    def __call__(self, lam, mu):
        """Evaluate the objective [m]."""
        full, K = self.full, self.stiffness(lam, mu)
        u = np.zeros(full.u.size)
        free = full.free_dofs
        u[free] = spsolve(K[free][:, free].tocsc(), full.f.ravel()[free])
        gap = u.reshape(-1, 3)[full.surface] - full.u[full.surface]
        error = np.linalg.norm(gap, axis=1).mean()
        return error if self.option == "displacement" else error + self._force_error(K)

    def _force_error(self, K):
        full = self.full
        u, inner, known = np.zeros(full.u.size), full.interior_dofs, full.surface_dofs
        u[known] = full.u.ravel()[known]
        u[inner] = spsolve(K[inner][:, inner].tocsc(), -K[inner][:, known] @ u[known])
        kept = np.setdiff1d(np.arange(len(full.u)), full.sets.support)
        gap = ((K @ u).reshape(-1, 3) - full.f)[kept]
        return full.force_weight * np.linalg.norm(gap, axis=1).mean()


def problem(count: int):
    """Pressed block with noise on its surface's displacement: mesh, node sets, measurement."""
    axes = [np.linspace(0, size, n) for size, n in zip(SIZE_M, GRIDS[count], strict=True)]
    grid = MeshTet.init_tensor(*axes)
    mesh = solid_mesh(grid.p.T, grid.t.T)
    middle = np.array([SIZE_M[0] / 2, SIZE_M[1] / 2, SIZE_M[2]])
    triangle = contact_triangle(mesh, middle, largest_distance_m=0.02)
    sets = node_sets(
        mesh,
        floor(1e-6),
        contact_nodes=triangle,
    )
    press = {"indenter_radius_m": 0.00622, "depth_m": 0.008}
    force = np.array([0.0, 0.0, -2.0])
    f = nodal_force(mesh, triangle, force, rule="conserve", turn_to_normal=True, **press)
    blank = np.zeros_like(f)
    blank[triangle] = 1e-3
    u = Objective(mesh, sets, Measurement(blank, f, 2.0), option="displacement").displacement(*TRUE)
    u += np.random.default_rng(count).normal(0, NOISE_M, u.shape)
    u[sets.interior] = np.nan
    return mesh, sets, Measurement(u, f, 2.0)


def seconds(function, rounds: int = 3) -> float:
    """Least time of a call over rounds."""
    best = np.inf
    for _ in range(rounds):
        start = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - start)
    return best


def estimate_rows() -> list[tuple]:
    """Evaluations on three meshes; a whole search on the middle one."""
    rows = assembly_rows()
    for count in GRIDS:
        mesh, sets, measurement = problem(count)
        for option in ("displacement", "force_displacement"):
            full = Objective(mesh, sets, measurement, option=option)
            fast, plain = ReducedObjective(full), PlainObjective(mesh, full)
            rows += _evaluation_rows(count, fast, plain)
        if count == 1250:
            rows += _search_rows(mesh, full, plain)
    return rows


def _evaluation_rows(count: int, fast: ReducedObjective, plain: PlainObjective) -> list[tuple]:
    label = f"{fast.option}, {count} nodes"
    against = "assembly and spsolve for each"
    repeats = 2000

    def many():
        for _ in range(repeats):
            fast(*TRUE)

    ratio = seconds(lambda: plain(*TRUE)) * repeats / seconds(many)
    moduli = [lame_from_engineering(2e4, nu) for nu in (0, 0.13, 0.25, 0.38, 0.45, 0.48, 0.498)]
    values = [(fast(*m), fast.full(*m)) for m in moduli]
    gap = max(abs(ours - true) / true for ours, true in values)
    error = max(largest_error(fast, *m) for m in moduli)
    return [
        (f"evaluation, {label}", ratio, "times faster", against),
        (f"evaluation, {label}", 1e6 * seconds(many) / repeats, "us", ""),
        (f"largest error of the objective, {label}", gap, "relative", "full solves"),
        (f"largest error of the reduced model, {label}", error, "relative", "full solves, energy"),
    ]


def _search_rows(mesh, full: Objective, plain: PlainObjective) -> list[tuple]:
    E_star = 1.3 * reduced_modulus(25998.5, 0.45)
    nodes = len(mesh.nodes_m)
    options = SEARCH | {"parametrisation": "lame"}

    def ours():
        fast = ReducedObjective(full)
        return minimise_error(fast, hertz_start(fast, E_star, STARTS), options)

    started = time.perf_counter()
    start = hertz_start(plain, E_star, STARTS)
    theirs = minimise_error(plain, start, options)
    took = time.perf_counter() - started
    label = f"{full.option}, {nodes} nodes"
    rows = [
        (
            f"model built and {len(theirs.trace)} iterations, {label}",
            took / seconds(ours),
            "times faster",
            "assembly and spsolve for each",
        ),
        ("difference of E found", abs(ours().youngs_modulus_pa / theirs.youngs_modulus_pa - 1),
         "relative", "the same search"),
    ]  # fmt: skip
    return rows + _counts(mesh, full, start)


def _counts(mesh, full: Objective, start: tuple[float, float]) -> list[tuple]:
    """Evaluations that each way takes from the same start to the same minimum."""
    fast = ReducedObjective(full)
    surface = {"nodes_m": mesh.nodes_m, "least_patch_m": 0.02}
    long = SEARCH | {"iterations": 1000}
    counts = {
        "Nelder-Mead in (lambda, mu)": minimise_error(
            fast, start, long | {"parametrisation": "lame"}
        ).evaluations,
        "Nelder-Mead in (log E, nu), bounded": minimise_error(fast, start, long).evaluations,
    } | {
        f"Levenberg-Marquardt, {norm}": fit_least_squares(
            fast, start, norm=norm, **surface, **BOUNDS
        ).evaluations
        for norm in NORMS
    }
    return [(f"evaluations, {name}", count, "", "") for name, count in counts.items()]


def assembly_rows() -> list[tuple]:
    """Which assembly the plain objective should use: ours or scikit-fem's of one K."""
    mesh = problem(1250)[0]
    basis = Basis(
        MeshTet(mesh.nodes_m.T, mesh.tetrahedra.T), ElementVector(ElementTetP1()), intorder=0
    )
    theirs = seconds(lambda: linear_elasticity(*TRUE).assemble(basis))
    ours = seconds(lambda: elastic_stiffness(mesh))
    return [("assembly of K1 and K2 anew", theirs / ours, "times faster", "scikit-fem, one K")]
