"""An indented block whose moduli are known."""

from dataclasses import dataclass

import numpy as np
from floor import floor
from numpy.typing import NDArray
from palpate.solid.load import contact_triangle, nodal_force
from palpate.solid.mesh import SolidMesh
from scipy.spatial.distance import cdist
from thesis.minimise.objective import Measurement, NodeSets, Objective, node_sets
from thesis.minimise.options import Minimise

# Section 3.3.2: the study's simulated block.
LAM, MU = 80685.0, 8965.0
BOUNDS = {"youngs_modulus_bounds_pa": (100.0, 1e8), "poisson_ratio_bounds": (0.0, 0.499)}
MINIMISE = Minimise(iterations=200)


@dataclass(frozen=True)
class IndentedBlock:
    """Mesh, node sets and measurement."""

    mesh: SolidMesh
    sets: NodeSets
    measurement: Measurement

    def objective(self, option: str) -> Objective:
        """Full objective for an option."""
        return Objective(self.mesh, self.sets, self.measurement, option=option)

    def noise(self, std_m: float, seed: int, length_m: float = 0.0) -> NDArray:
        """Normal noise (n, 3) [m] whose correlation falls as exp(-distance / length)."""
        rng = np.random.default_rng(seed)
        drawn = rng.normal(0, std_m, self.mesh.nodes_m.shape)
        if not length_m:
            return drawn
        distance = cdist(self.mesh.nodes_m, self.mesh.nodes_m)
        return np.linalg.cholesky(np.exp(-distance / length_m)) @ drawn

    def moved(self, error_m: NDArray) -> "IndentedBlock":
        """The same with an error of each node's displacement."""
        known = self.measurement
        found = Measurement(known.displacement_m + error_m, known.force_n, known.total_force_n)
        return IndentedBlock(self.mesh, self.sets, found)

    def noisy(self, std_m: float, seed: int = 5) -> "IndentedBlock":
        """The same with independent noise on each node's displacement."""
        return self.moved(self.noise(std_m, seed))


def indented_block(mesh: SolidMesh, point_m: list[float]) -> IndentedBlock:
    """Indent a mesh that stands on z = 0 with 2 N at a point; exact at (LAM, MU)."""
    triangle = contact_triangle(mesh, np.array(point_m), largest_distance_m=0.03)
    force, sphere = np.array([0.0, 0.0, -2.0]), {"indenter_radius_m": 0.00622, "depth_m": 0.008}
    forces = nodal_force(mesh, triangle, force, rule="conserve", turn_to_normal=True, **sphere)
    sets = node_sets(mesh, floor(1e-3), contact_nodes=triangle)
    blank = np.zeros_like(forces)
    blank[triangle] = 1e-3
    forward = Objective(mesh, sets, Measurement(blank, forces, 2.0), option="displacement")
    u = forward.displacement(LAM, MU)
    u[sets.interior] = np.nan
    return IndentedBlock(mesh, sets, Measurement(u, forces, 2.0))
