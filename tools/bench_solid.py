"""Figures of the solid: assembly of both orders and the direct solvers against each other."""

import time
from pathlib import Path

import numpy as np
from palpate.solid.mesh import SolidMesh, quadratic, read_solid
from palpate.solid.moduli import lame_from_engineering
from palpate.solid.refine import refine_near
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, elastic_stiffness
from skfem import Basis, ElementTetP1, ElementTetP2, ElementVector, MeshTet
from skfem.models.elasticity import linear_elasticity

ROOT = Path(__file__).resolve().parents[1]
ROUNDS = 3
CONTACT = np.array([-0.05, 0, 0.0475])


def solid_rows() -> list[tuple]:
    """Rows (name, value, unit, against) of the solid."""
    meshes = solid_meshes()
    rows = [row for mesh in meshes[:2] for row in assembly_rows(mesh)]
    return rows + [row for mesh in meshes for row in solver_rows(mesh)]


def solid_meshes() -> list[SolidMesh]:
    """Blocks of about 0.7, 4, 2.7, 6, 20 and 30 thousand unknowns."""
    small, large = (
        read_solid(ROOT / f"config/meshes/{n}_block.vtu") for n in ("simulated", "foam")
    )
    near = refine_near(large, CONTACT, radius_m=0.02, edge_m=0.007)
    some = refine_near(small, CONTACT, radius_m=0.03, edge_m=0.01)
    return [small, quadratic(small), large, near, quadratic(large), quadratic(some)]


def seconds(function) -> float:
    """Shortest of a few times."""
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def assembly_rows(mesh: SolidMesh) -> list[tuple]:
    """Assembly of K1 and K2 against scikit-fem's of one matrix."""
    element = ElementVector(ElementTetP1() if mesh.order == 1 else ElementTetP2())
    points = mesh.nodes_m[: mesh.corners.max() + 1].T
    cells = MeshTet(*map(np.ascontiguousarray, (points, mesh.corners.T)))

    def reference():
        basis = Basis(cells, element, intorder=2 * (mesh.order - 1))
        return linear_elasticity(1.0, 1.0).assemble(basis)

    name = f"assembly of {len(mesh.tetrahedra)} elements of order {mesh.order}"
    ours = seconds(lambda: elastic_stiffness(mesh))
    return [
        (name, 1000 * ours, "ms", ""),
        (name, seconds(reference) / ours, "times faster", "scikit-fem assembly"),
    ]


def solver_rows(mesh: SolidMesh) -> list[tuple]:
    """Factorisation, the same for another matrix of its entries, and solution."""
    free = np.repeat(mesh.nodes_m[:, 2] > 1e-6, 3)
    parts = [K[free][:, free] for K in elastic_stiffness(mesh)]
    K, other = (combined(*parts, *lame_from_engineering(25e3, nu)) for nu in (0.3, 0.45))
    f, found, rows = np.ones(K.shape[0]), {}, []
    for solver in ("superlu", "pardiso"):
        first = seconds(lambda solver=solver: factorise(K, solver=solver))
        factors = factorise(K, solver=solver)
        found[solver] = factors(f)
        again = seconds(lambda factors=factors: factors.refactorise(other))
        solution = seconds(lambda factors=factors: factors(f))
        for what, value in (("first", first), ("next", again), ("solution", solution)):
            rows.append((f"{solver}, {len(f)} unknowns, {what}", 1000 * value, "ms", ""))
    gap = np.abs(found["pardiso"] - found["superlu"]).max() / np.abs(found["superlu"]).max()
    faster = rows[1][1] / rows[4][1]
    return [
        *rows,
        (f"next factorisation of {len(f)} unknowns", faster, "times faster", "SuperLU"),
        (f"disagreement of the solvers, {len(f)} unknowns", gap, "relative", "SuperLU"),
    ]


if __name__ == "__main__":
    for row in solid_rows():
        print("{:50s} {:10.3g} {} {}".format(*row))
