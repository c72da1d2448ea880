"""An indented block whose moduli are known."""

from dataclasses import replace

import numpy as np
from floor import floor
from palpate.solid.laws import engineering_from_lame
from palpate.solid.load import contact_triangle, nodal_force
from scipy.spatial.distance import cdist
from thesis.minimise.objective import Objective, Problem, node_sets

# Section 3.3.2: the study's simulated block.
LAM, MU = 80685.0, 8965.0
TRUE = engineering_from_lame(LAM, MU)


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
