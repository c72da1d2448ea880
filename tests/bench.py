"""Figures of speed and accuracy, as ratios measured side by side in one run.

``make bench`` writes results/bench.csv (name,value,unit,against) and prints it.
"""

import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import trimesh
from bench_lab import lab_rows
from bench_vision import vision_rows
from palpate.capture.files import whole_file
from palpate.estimate.moduli import lame_from_engineering
from palpate.solid.fill import refine_near
from palpate.solid.mesh import read_solid
from palpate.solid.solve import factorise
from palpate.solid.stiffness import elastic_stiffness
from palpate.surface.distance import ClosestPoints
from skfem import Basis, ElementTetP1, ElementVector, MeshTet
from skfem.models.elasticity import linear_elasticity

ROOT = Path(__file__).resolve().parents[1]
ROUNDS = 7


def ratio(ours, other) -> float:
    """Median over rounds of the other's time over ours, the two in turn."""
    ratios = []
    for _ in range(ROUNDS):
        seconds = []
        for function in (ours, other):
            start = time.perf_counter()
            function()
            seconds.append(time.perf_counter() - start)
        ratios.append(seconds[1] / seconds[0])
    return float(np.median(ratios))


def solid_rows() -> list[tuple]:
    """Assembly and solution of the solid's equations."""
    kept = read_solid(ROOT / "config/meshes/foam_block.vtu")
    mesh = refine_near(kept, np.array([-0.05, 0, 0.0475]), radius_m=0.02, edge_m=0.007)
    K1, K2 = elastic_stiffness(mesh)
    lam, mu = lame_from_engineering(25e3, 0.3)
    free = np.repeat(mesh.nodes_m[:, 2] > 1e-6, 3)
    f = np.ones(free.sum())

    def reassemble():
        basis = Basis(
            MeshTet(mesh.nodes_m.T, mesh.tetrahedra.T), ElementVector(ElementTetP1()), intorder=0
        )
        return linear_elasticity(lam, mu).assemble(basis)

    def combine():
        return lam * K1 + mu * K2

    def solve():
        return factorise(combine()[free][:, free])(f)

    def solve_reassembled():
        basis_K = reassemble()
        return factorise(basis_K[free][:, free])(f)

    return [
        (
            "stiffness from K1 and K2",
            ratio(combine, reassemble),
            "times faster",
            "scikit-fem assembly",
        ),
        (
            "one evaluation of the displacement term",
            ratio(solve, solve_reassembled),
            "times faster",
            "reassembly and factorisation",
        ),
        ("nodes of the refined solid", float(len(mesh.nodes_m)), "", ""),
    ]


def surface_rows() -> list[tuple]:
    """Closest points on a template."""
    box = trimesh.creation.icosphere(subdivisions=4, radius=0.06)
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (5000, 3))
    closest = ClosestPoints(box.vertices, box.faces)
    found = ratio(lambda: closest(points), lambda: trimesh.proximity.closest_point(box, points))
    return [("closest points on a template", found, "times faster", "trimesh.proximity")]


def main(target: Path) -> None:
    """Measure, write and print."""
    rows = solid_rows() + surface_rows() + vision_rows(ratio) + lab_rows(ratio)
    table = pd.DataFrame(rows, columns=["name", "value", "unit", "against"])
    table["value"] = [float(f"{value:.3g}") for value in table["value"]]
    with whole_file(target) as part:
        table.to_csv(part, index=False)
    print(table.to_string(index=False))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
