"""Figure 3.8: moves of the Nelder-Mead simplex on the simulated block's error."""

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.estimate.objective import Measurement, Objective
from palpate.solid.boundary import node_sets
from palpate.solid.mesh import solid_mesh
from palpate.solid.support import Support
from palpate.study import simplex, style

# The first triangle, as the study's grid of starts has it: nu 0.25 at the Hertz modulus [Pa].
FIRST_PA = np.array([[14e3, 14e3], [24e3, 14e3], [14e3, 17e3]])
RATIOS = np.geomspace(0.3, 30, 120)
SHEAR_MODULI_PA = np.linspace(4e3, 24e3, 200)
STEPS, SHOWN = 14, 0


def main(snakemake):
    """Take the last load step's displacement as measured, and draw the figure."""
    cost = objective(snakemake.input.steps)
    path = simplex.simplexes(lambda x: cost(*x) if min(x) > 0 else np.inf, FIRST_PA, STEPS)
    field = simplex.error_field(
        lambda ratio: cost.displacement(ratio, 1.0)[cost.surface],
        cost.u[cost.surface],
        RATIOS,
        SHEAR_MODULI_PA,
    )
    with style.journal():
        figure = simplex.figure_3_8(field, path, SHOWN, None)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


def objective(path):
    """Displacement error (Eq. 3.33) of the simulated block."""
    with np.load(path, allow_pickle=False) as data:
        mesh = solid_mesh(data["nodes_m"], data["tetrahedra"])
        triangle, force = data["triangle"], data["force_n"][-1]
        displacement = data["displacement_m"][-1].copy()
    support = Support(np.zeros(3), np.array([0.0, 0.0, 1.0]), 1e-6)
    sets = node_sets(mesh, support, contact_nodes=triangle)
    total = float(np.linalg.norm(force.sum(axis=0)))
    return Objective(mesh, sets, Measurement(displacement, force, total), option="displacement")


run(main, snakemake)
