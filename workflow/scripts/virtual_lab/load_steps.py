"""Force and surface of an object over load steps, shared by its recordings."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from palpate.npz import write_npz
from scipy.interpolate import PchipInterpolator

from virtual_lab.obstacle import DOWN

# Hertz: force to the power 2/3 is about linear in depth, which interpolates well.
FORCE_POWER = 2 / 3


@dataclass(frozen=True)
class LoadSteps:
    """Force and surface of an object over growing indentation depths.

    Attributes
    ----------
    point_m : (3,) array
        Foremost point of the sphere when it first touches, object frame [m].
    depth_m : (k,) array
        Depths along the direction, from 0 [m].
    force_n : (k,) array
        Force against the direction that the object returns [N].
    surface_rest_m : (n, 3) array
        Closed undeformed surface, object frame [m].
    surface_faces : (m, 3) int array
        Its triangles, outward.
    surface_displacement_m : (k, n, 3) array
        Its displacement at each depth [m].
    direction : (3,) array, optional
        Of the indentation, of length 1.
    heading : (k, 3) array, optional
        Force over its part against the direction; none: the force has no other part.
    """

    point_m: NDArray
    depth_m: NDArray
    force_n: NDArray
    surface_rest_m: NDArray
    surface_faces: NDArray
    surface_displacement_m: NDArray
    direction: NDArray | tuple[float, ...] = DOWN
    heading: NDArray | None = None

    def force_at(self, depth_m: NDArray) -> NDArray:
        """Elastic force at depths [N]; zero before contact."""
        curve = PchipInterpolator(self.depth_m, self.force_n**FORCE_POWER)
        return np.maximum(curve(self._within(depth_m)), 0) ** (1 / FORCE_POWER)

    def force_vector_at(self, depth_m: NDArray) -> NDArray:
        """Elastic force of the object on the sphere at depths, shape (len(depth_m), 3) [N]."""
        heading = np.negative(self.direction)
        if self.heading is not None:
            heading = PchipInterpolator(self.depth_m, self.heading)(self._within(depth_m))
        return self.force_at(depth_m)[:, None] * heading

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


def write_load_steps(path: str | Path, steps: LoadSteps) -> None:
    """Write load steps as NPZ; of those straight down without a direction."""
    write_npz(path, {k: v for k, v in vars(steps).items() if v is not None and v is not DOWN})


def read_load_steps(path: str | Path) -> LoadSteps:
    """Read what `write_load_steps` wrote."""
    with np.load(path, allow_pickle=False) as data:
        return LoadSteps(**{name: data[name] for name in data.files})


def mirrored(steps: LoadSteps, point_m: NDArray) -> LoadSteps:
    """Load steps of the mirror image of their point in a symmetric object.

    Parameters
    ----------
    steps : LoadSteps
    point_m : (3,) array
        Point on the line of the indentation, or one whose x and y have other signs [m].

    Raises
    ------
    ValueError
        If the point is no mirror image.
    """
    signs = np.where(np.asarray(point_m) * steps.point_m < 0, -1.0, 1.0)
    direction = signs * steps.direction
    if np.abs(np.cross(signs * steps.point_m - point_m, direction)).max() > 1e-6:
        expected, found = steps.point_m.tolist(), np.asarray(point_m).tolist()
        raise ValueError(f"point: expected a mirror image of {expected}, found {found}")
    return replace(
        steps,
        point_m=signs * steps.point_m,
        surface_rest_m=signs * steps.surface_rest_m,
        surface_faces=steps.surface_faces[:, :: int(signs.prod())],
        surface_displacement_m=signs * steps.surface_displacement_m,
        direction=direction,
        heading=None if steps.heading is None else signs * steps.heading,
    )
