"""Force and surface of a pressed object over a ladder of depths, shared by its recordings."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

# Hertz: force to the power 2/3 is about linear in depth, which interpolates well.
FORCE_POWER = 2 / 3


@dataclass(frozen=True)
class ContactLadder:
    """Force and surface of an object over a ladder of indentation depths.

    Attributes
    ----------
    point_m : (3,) array
        Lowest point of the sphere when it first touches, object frame [m].
    depth_m : (k,) array
        Depths, from 0 [m].
    force_n : (k,) array
        Force along the outward normal that the object returns [N].
    surface_rest_m : (n, 3) array
        Closed undeformed surface, object frame [m].
    surface_faces : (m, 3) int array
        Its triangles, outward.
    surface_displacement_m : (k, n, 3) array
        Its displacement at each depth [m].
    """

    point_m: NDArray
    depth_m: NDArray
    force_n: NDArray
    surface_rest_m: NDArray
    surface_faces: NDArray
    surface_displacement_m: NDArray

    def force_at(self, depth_m: NDArray) -> NDArray:
        """Elastic force at depths [N]; zero before contact."""
        curve = PchipInterpolator(self.depth_m, self.force_n**FORCE_POWER)
        return np.maximum(curve(self._within(depth_m)), 0) ** (1 / FORCE_POWER)

    def surface_at(self, depth_m: NDArray) -> NDArray:
        """Deformed surface at depths, shape (len(depth_m), n, 3) [m]."""
        curve = PchipInterpolator(self.depth_m, self.surface_displacement_m, axis=0)
        return self.surface_rest_m + curve(self._within(depth_m))

    def _within(self, depth_m: NDArray) -> NDArray:
        depth = np.maximum(np.asarray(depth_m, dtype=float), 0)
        if depth.max() > self.depth_m[-1]:
            found = f"{depth.max():.4f}"
            raise ValueError(f"depth: expected at most {self.depth_m[-1]:.4f} m, found {found} m")
        return depth


def save_ladder(path: str | Path, ladder: ContactLadder) -> None:
    """Write a ladder as NPZ."""
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **vars(ladder))


def load_ladder(path: str | Path) -> ContactLadder:
    """Read a ladder that `save_ladder` wrote."""
    with np.load(path, allow_pickle=False) as data:
        return ContactLadder(**{name: data[name] for name in data.files})


def mirrored(ladder: ContactLadder, point_m: NDArray) -> ContactLadder:
    """Ladder of the mirror image of its point in a symmetric object.

    Parameters
    ----------
    ladder : ContactLadder
    point_m : (3,) array
        Point whose x and y have the ladder's sizes, with any signs [m].

    Raises
    ------
    ValueError
        If the point is no mirror image.
    """
    signs = np.where(np.asarray(point_m) * ladder.point_m < 0, -1.0, 1.0)
    if np.abs(signs * ladder.point_m - point_m)[:2].max() > 1e-6:
        found = np.asarray(point_m).tolist()
        raise ValueError(
            f"point: expected a mirror image of {ladder.point_m.tolist()}, found {found}"
        )
    faces = ladder.surface_faces[:, ::-1] if signs.prod() < 0 else ladder.surface_faces
    return ContactLadder(
        signs * ladder.point_m,
        ladder.depth_m,
        ladder.force_n,
        signs * ladder.surface_rest_m,
        faces,
        signs * ladder.surface_displacement_m,
    )
