"""Indentation table of one point: force and surface over depth, Poisson's ratio and law."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.npz import read_shaped, write_npz
from palpate.open3d_core import ClosestPoints
from palpate.solid.laws import SLIDING
from palpate.solid.support import Support

# How far a mirrored template may be from itself: scans and their meshes agree to about that [m].
IMAGE_TOLERANCE_M = 0.001
# Points of a facet that are compared, barycentric.
POINTS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1 / 3, 1 / 3, 1 / 3]])
SHAPES = {
    "point_m": (3,),
    "direction": (3,),
    "radius_m": (),
    "laws": ("laws",),
    "poisson_ratios": ("ratios",),
    "depth_m": ("depths",),
    "force_per_modulus_m2": ("laws", "ratios", "depths"),
    "surface_rest_m": ("nodes", 3),
    "surface_faces": ("faces", 3),
    "surface_displacement_m": ("laws", "ratios", "depths", "nodes", 3),
}


@dataclass(frozen=True)
class IndentationModel:
    """Answers of a solid to a rigid frictionless sphere, for Young's modulus 1.

    Attributes
    ----------
    point_m : (3,) array
        Where the sphere touches first, on its line, object frame [m].
    direction : (3,) array
        Of the press, into the object, length 1.
    radius_m : float
        Of the sphere [m].
    laws : tuple of str
        l names of laws (`palpate.solid.laws`), last the first once more, on a foot that slides, if
        that matters. All but the first are solved at the least and the greatest Poisson's ratio
        alone.
    poisson_ratios : (p,) array
        Increasing.
    depth_m : (k,) array
        Way of the sphere since the first touch, from 0 [m].
    force_per_modulus_m2 : (l, p, k) array
        Force along the direction over Young's modulus [m^2].
    surface_rest_m : (n, 3) array
        Surface of the undeformed solid [m].
    surface_faces : (m, 3) int array
        Its triangles, outward.
    surface_displacement_m : (l, p, k, n, 3) float32 array
        [m].
    """

    point_m: NDArray
    direction: NDArray
    radius_m: float
    laws: tuple[str, ...]
    poisson_ratios: NDArray
    depth_m: NDArray
    force_per_modulus_m2: NDArray
    surface_rest_m: NDArray
    surface_faces: NDArray
    surface_displacement_m: NDArray

    @property
    def slides(self) -> bool:
        """Whether the object has a broad base that is not bonded."""
        return any(law.endswith(SLIDING) for law in self.laws)


def ratio_weights(ratios: NDArray, nu: float) -> tuple[NDArray, NDArray]:
    """Lagrange's polynomials of a table's Poisson's ratios at one, and their slopes, (p,) each."""
    return _ratio_weights(tuple(ratios.tolist()), float(nu))


# A fit asks some ten times for each ratio that it tries.
@lru_cache(maxsize=16)
def _ratio_weights(ratios: tuple[float, ...], nu: float) -> tuple[NDArray, NDArray]:
    power = np.arange(len(ratios))
    at = np.stack([nu**power, power * nu ** np.maximum(power - 1, 0)], axis=1)
    both = np.linalg.solve(np.vander(ratios, increasing=True).T, at).T
    both.flags.writeable = False
    return both[0], both[1]


def image_table(
    model: IndentationModel,
    support: Support,
    surface: tuple[NDArray, NDArray],
    normals: Sequence[Sequence[float]],
) -> IndentationModel:
    """Table of a mirror image of another point, in an object that is its own image.

    Parameters
    ----------
    model : IndentationModel
        Of the other point.
    support : Support
        Its point is in all mirrors.
    surface : (vertices (n, 3) [m], faces (m, 3))
        The object's template.
    normals : sequence of three floats
        Of the mirrors that lead from the other point to this one.

    Raises
    ------
    ValueError
        If the template is not its own image.
    """
    for normal in normals:
        unit = np.array(normal, float) / np.linalg.norm(normal)
        turn = np.eye(3) - 2 * np.outer(unit, unit)
        _check_image(*surface, support.plane_point_m, unit)
        moved = {
            "point_m": _image(model.point_m, support.plane_point_m, unit),
            "direction": model.direction @ turn,
            "surface_rest_m": _image(model.surface_rest_m, support.plane_point_m, unit),
            "surface_faces": model.surface_faces[:, [0, 2, 1]],
            "surface_displacement_m": model.surface_displacement_m @ turn.astype(np.float32),
        }
        model = IndentationModel(**vars(model) | moved)
    return model


def _image(points_m: NDArray, through_m: NDArray, normal: NDArray) -> NDArray:
    """Mirror images of points (..., 3) in the plane through a point [m]."""
    away = (points_m - through_m) @ normal
    return points_m - 2 * away[..., None] * normal


def _check_image(vertices_m: NDArray, faces: NDArray, through_m: NDArray, normal: NDArray) -> None:
    """Reject a mirror in which vertices and middles of facets are not on the surface again."""
    places = _image(np.matmul(POINTS, vertices_m[faces]).reshape(-1, 3), through_m, normal)
    gap = ClosestPoints(vertices_m, faces).distance(places).max()
    if not gap <= IMAGE_TOLERANCE_M:
        raise ValueError(
            f"mirrors: expected planes in which the template is its own image within"
            f" {IMAGE_TOLERANCE_M:g} m, found {normal.tolist()} with {gap:.2g} m"
        )


def save_indentation(path: str | Path, model: IndentationModel) -> None:
    """Write indentation-<point>.npz."""
    write_npz(path, vars(model) | {"laws": np.array(model.laws)})


def load_indentation(path: str | Path) -> IndentationModel:
    """Read indentation-<point>.npz.

    Raises
    ------
    ValueError
        If the file is no such archive, or an array is missing or of another shape.
    """
    arrays = read_shaped(path, SHAPES, what="an indentation table")
    plain = {
        "radius_m": float(arrays["radius_m"]),
        "laws": tuple(str(law) for law in arrays["laws"]),
    }
    return IndentationModel(**arrays | plain)
