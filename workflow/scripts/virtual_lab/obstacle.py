"""Rigid bodies that an object touches: the probe's sphere, and the table."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

DOWN = (0.0, 0.0, -1.0)


@dataclass(frozen=True)
class Sphere:
    """The indenter, which comes along a line.

    Attributes
    ----------
    start_m : (3,) array
        Its centre when it first touches [m].
    radius_m, friction : float
        Radius [m] and Coulomb's coefficient.
    direction : (3,) tuple
        In which it goes, of length 1.
    penalty : float
        Its stiffness, in the solver's.
    patch : str
        Facets of the mesh that it can touch.
    """

    start_m: NDArray
    radius_m: float
    friction: float = 0.0
    direction: tuple[float, ...] = DOWN
    penalty: float = 1.0
    patch: str = "top"

    def place(self, depth_m: float) -> NDArray:
        """Its centre at a depth, shape (3,) [m]."""
        return np.asarray(self.start_m) + depth_m * np.asarray(self.direction)

    def gap(self, points_m: NDArray, depth_m: float) -> tuple[NDArray, NDArray, NDArray]:
        """Gap (...) [m], outward normal (..., 3) and curvature (...) [1/m] seen from points."""
        offset = points_m - self.place(depth_m)
        distance = np.linalg.norm(offset, axis=-1)
        return distance - self.radius_m, offset / distance[..., None], 1 / distance


@dataclass(frozen=True)
class Table:
    """The plane z = 0; attributes as of `Sphere`."""

    friction: float = 0.0
    penalty: float = 1.0
    patch: str = "bottom"

    def place(self, depth_m: float) -> NDArray:
        """Return a point that is fixed to it, shape (3,) [m]."""
        return np.zeros(3)

    def gap(self, points_m: NDArray, depth_m: float) -> tuple[NDArray, NDArray, NDArray]:
        """As `Sphere.gap`."""
        height = points_m[..., 2]
        return height, np.broadcast_to([0.0, 0.0, 1.0], points_m.shape), np.zeros_like(height)
