"""What a surface may not enter: the indenter's sphere and the table."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Sphere:
    """The indenter: centre (3,) and radius [m]."""

    centre_m: NDArray
    radius_m: float

    def depths(self, points_m: NDArray) -> tuple[NDArray, NDArray]:
        """How deep points (k, 3) lie inside, (k,) [m], and unit ways out of it, (k, 3)."""
        away = points_m - self.centre_m
        distance = np.linalg.norm(away, axis=1)
        return self.radius_m - distance, away / np.maximum(distance, 1e-12)[:, None]


@dataclass(frozen=True)
class Table:
    """The plane that the object stands on: a point (3,) [m] and its unit normal (3,), upwards."""

    point_m: NDArray
    normal: NDArray

    def depths(self, points_m: NDArray) -> tuple[NDArray, NDArray]:
        """How deep points (k, 3) lie below, (k,) [m], and unit ways out of it, (k, 3)."""
        depth = -(points_m - self.point_m) @ self.normal
        return depth, np.broadcast_to(self.normal, points_m.shape)
