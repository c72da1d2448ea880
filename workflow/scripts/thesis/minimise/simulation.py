"""The inverse problem of the simulated block (Sections 3.3.2 to 3.3.4)."""

import numpy as np
from numpy.typing import NDArray
from palpate.solid.support import Support
from palpate.surface.simulation import SimulatedSteps
from palpate.surface.tracked import Tracked

from thesis.minimise.objective import Measurement, node_sets
from thesis.minimise.problem import Problem


def pose_simulation(
    steps: SimulatedSteps, support: Support, *, tracked: Tracked | None = None
) -> Problem:
    """Pose the inverse problem of the last simulated frame.

    The loads are the simulation's; the surface's displacement is the simulation's too, or the
    tracker's. Interior displacements are left out.

    Parameters
    ----------
    steps : SimulatedSteps
    support : Support
        What holds the block.
    tracked : Tracked, optional
        Its vertices are the solid's surface nodes.

    Raises
    ------
    ValueError
        If the tracked surface is not the solid's.
    """
    nodes = steps.mesh.surface_nodes()
    if tracked is None:
        moved = steps.displacement_m[-1, nodes]
    else:
        if len(tracked.template_m) != len(nodes):
            count = len(tracked.template_m)
            raise ValueError(f"tracked: expected {len(nodes)} vertices, found {count}")
        moved = tracked.vertices_m[-1] - tracked.vertices_m[0]
    displacement = np.full(steps.mesh.nodes_m.shape, np.nan)
    displacement[nodes] = moved
    sets = node_sets(steps.mesh, support, contact_nodes=steps.triangle)
    force = steps.force_n[-1]
    total = float(np.linalg.norm(force.sum(axis=0)))
    return Problem(steps.mesh, sets, Measurement(displacement, force, total))


def pressed_area_modulus(problem: Problem, triangle: NDArray) -> float:
    """E* from a load on a triangle, for want of a sphere whose Hertz fit would give it [Pa].

    Takes a half space under uniform pressure on a circle of the triangle's area, whose mean
    displacement is 16 p a / (3 pi E*) (Johnson, Contact Mechanics, 1985, Section 3.4).

    Parameters
    ----------
    problem : Problem
    triangle : (3,) int array
        Loaded nodes.
    """
    a, b, c = problem.mesh.nodes_m[triangle]
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal) / 2
    moved = problem.measurement.displacement_m[triangle].mean(axis=0)
    depth = abs(moved @ normal) / (2 * area)
    pressure = problem.measurement.total_force_n / area
    return float(16 * pressure * np.sqrt(area / np.pi) / (3 * np.pi * depth))
