"""The lab's figures of speed and convergence, for ``make bench``."""

import sysconfig
import time
from pathlib import Path

import numpy as np
import yaml
from scipy import sparse
from scipy.optimize import least_squares
from scipy.sparse.linalg import splu
from virtual_lab.block_mesh import block_mesh
from virtual_lab.contact import ContactProblem
from virtual_lab.material import neo_hookean
from virtual_lab.obstacle import Sphere
from virtual_lab.press import contact_problem, first_touch, patch_points
from virtual_lab.shapes import shape_of

ROOT = Path(__file__).resolve().parents[1]
RADIUS_M = 0.00622
# Elements along each side of a small block that is refined evenly, and depths to average over.
SIZES = np.array([4, 5, 6, 7, 8, 9, 10, 12])
DEPTHS_M = np.linspace(0.0008, 0.0016, 9)
SIDE_M = 0.012
MEGABYTE = 1e6


def lab_rows(ratio) -> list[tuple]:
    """Sparse solvers against each other, the steps_of' cost, and the mesh's convergence."""
    return [*solver_rows(ratio), *ladder_rows(), *convergence_rows()]


def solver_rows(ratio) -> list[tuple]:
    """PARDISO and SuperLU on the tangent matrix of the block's ladder."""
    problem = _problem("foam_block", "08")
    u = np.zeros(problem.fixed.size)
    _, blocks = problem._elastic(u)
    parts = [(np.arange(len(blocks)), blocks)]
    load = np.random.default_rng(0).normal(size=problem.tangent.count)
    upper = problem.tangent.matrix(parts)
    full = sparse.csc_matrix(upper + sparse.triu(upper, 1).T)
    ours = problem.tangent.solve(parts, load)
    assert np.allclose(full @ ours, load, atol=1e-6)

    def changed():
        # PARDISO keeps its factors for a matrix that it knows.
        blocks[0, 0, 0, 0, 0] *= 1 + 1e-9
        return problem.tangent.solve(parts, load)

    name = f"tangent of {problem.tangent.count} unknowns: PARDISO, pattern known"
    found = ratio(changed, lambda: splu(full, permc_spec="MMD_AT_PLUS_A").solve(load))
    packages = Path(sysconfig.get_path("purelib"))
    mkl = sum(p.stat().st_size for p in packages.parents[1].glob("libmkl*")) / MEGABYTE
    scipy = sum(
        p.stat().st_size
        for folder in ("scipy", "scipy.libs")
        for p in (packages / folder).rglob("*")
        if p.is_file()
    )
    return [
        (name, found, "times faster", "SciPy's SuperLU"),
        ("installed size of PARDISO (MKL)", mkl, "MB", f"SciPy {scipy / MEGABYTE:.0f} MB"),
    ]


def ladder_rows() -> list[tuple]:
    """Seconds of one ladder a kind of object."""
    rows = []
    for name, point in (("foam_block", "07"), ("foam_ball", "01"), ("ear", "01")):
        start = time.perf_counter()
        problem = _problem(name, point)
        contact = _lab()["objects"][name]["contact"]
        count = int(np.ceil(contact["deepest_m"] / contact["step_m"] - 1e-9))
        problem.press(np.linspace(0, contact["deepest_m"], count + 1)[1:])
        seconds = time.perf_counter() - start
        rows.append((f"ladder of {name}, point {point}", seconds, "s", "90 s"))
    return rows


def convergence_rows() -> list[tuple]:
    """Order at which the energy converges with the mesh, and what is left in the force.

    Means over several depths: at one depth the error jumps as the contact's edge passes nodes.
    """
    found = [_small_block(size) for size in SIZES]
    energy, force = (np.array([pair[k] for pair in found]) for k in range(2))
    means = (energy / energy[-1]).mean(axis=1)

    def misfit(parameters):
        left, scale, order = parameters
        return np.log(means - means.min() + np.exp(left)) - scale + order * np.log(SIZES)

    left, _, order = least_squares(misfit, [-6.0, 0.0, 2.0]).x
    spread = np.ptp((force / force[-1]).mean(axis=1)[-4:]) * 100
    return [
        ("order of the energy in the element's size", order, "", "8 meshes, 64 to 1728 elements"),
        ("energy left over on the finest of them", 100 * np.exp(left), "%", "fitted limit"),
        ("spread of the force over the four finest", spread, "%", ""),
    ]


def _small_block(count: int) -> tuple:
    """Energy and force over depths of a block with even elements, a quarter of it."""
    axis = np.linspace(0, SIDE_M, count + 1)
    solid = block_mesh(axis, axis, axis, reach_m=0.008, centre_m=np.zeros(2)).solid
    fixed = np.zeros(solid.nodes_m.shape, dtype=bool)
    fixed[solid.nodes_m[:, 2] < 1e-9] = True
    for side in range(2):
        fixed[solid.nodes_m[:, side] < 1e-9, side] = True
    sphere = Sphere(np.array([0, 0, SIDE_M + RADIUS_M]), RADIUS_M)
    problem = ContactProblem(
        solid, neo_hookean(25e3, 0.3), [sphere], stiffness_pa=25e3, fixed=fixed
    )
    steps = problem.press(DEPTHS_M)
    energy = np.array([step.energy_j for step in steps])
    return energy, -np.array([step.forces_n[0, 2] for step in steps])


def _lab() -> dict:
    return yaml.safe_load((ROOT / "config/lab.yaml").read_text())


def _problem(name: str, point: str) -> ContactProblem:
    spec = _lab()["objects"][name]
    place = np.array(spec["object"]["points"][point]["position_m"])
    model = shape_of(spec).model(place, spec["contact"])
    start = first_touch(patch_points(model.solid, "top"), place, RADIUS_M)
    return contact_problem(spec, model, start, RADIUS_M)
