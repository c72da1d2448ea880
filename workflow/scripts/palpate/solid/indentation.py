"""Indentation table of one pressed point: force and surface over depth, Poisson's ratio and law."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from palpate.npz import read_npz
from palpate.solid.options import greatest_ratio

# In this power of the force Hertz's contact is straight over depth.
STRAIGHT = 2 / 3
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
        l names of laws (`palpate.solid.laws`). All but the first are solved at the least and the
        greatest Poisson's ratio alone.
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

    def force_per_modulus(self, depth_m: NDArray | float, nu: float, law: str) -> NDArray:
        """Force over Young's modulus at depths [m], in their shape [m^2].

        0 where the sphere does not touch. Polynomial in Poisson's ratio; over depth the force's
        power 2/3 is interpolated, monotonically.

        Raises
        ------
        ValueError
            If the law is not in the table, or depth or Poisson's ratio are beyond it.
        """
        depth = self._checked(depth_m, nu)
        weights, _ = ratio_weights(self.poisson_ratios, nu)
        table = weights @ self.force_per_modulus_m2[self._law(law)]
        straight = PchipInterpolator(self.depth_m, np.maximum(table, 0) ** STRAIGHT)
        return straight(depth) ** (1 / STRAIGHT)

    def displacement(self, depth_m: NDArray | float, nu: float, law: str) -> NDArray:
        """Displacement of the surface's nodes at depths [m], shape (..., n, 3) [m].

        0 where the sphere does not touch. Polynomial in Poisson's ratio, cubic splines over depth.

        Raises
        ------
        ValueError
            As `force_per_modulus` does.
        """
        depth = self._checked(depth_m, nu)
        over_depth = CubicSpline(self.depth_m, np.eye(len(self.depth_m)), axis=0)(depth)
        weights, _ = ratio_weights(self.poisson_ratios, nu)
        weights = weights[:, None] * over_depth[..., None, :]
        table = self.surface_displacement_m[self._law(law)]
        return np.tensordot(weights, table, axes=2)

    def _law(self, law: str) -> int:
        if law not in self.laws:
            raise ValueError(f"law: expected one of {', '.join(self.laws)}, found {law}")
        return self.laws.index(law)

    def _checked(self, depth_m: NDArray | float, nu: float) -> NDArray:
        """Depths from 0 on."""
        depth = np.asarray(depth_m, dtype=float)
        deepest, least = self.depth_m[-1], self.poisson_ratios[0]
        greatest = greatest_ratio(self.poisson_ratios)
        if not (depth <= deepest * (1 + 1e-9)).all():
            raise ValueError(f"depth_m: expected at most {deepest:g}, found {depth.max():g}")
        if not least - 1e-9 <= nu <= greatest + 1e-9:
            raise ValueError(f"nu: expected from {least:g} to {greatest:g}, found {nu:g}")
        return np.clip(depth, 0, deepest)


def ratio_weights(ratios: NDArray, nu: float) -> tuple[NDArray, NDArray]:
    """Lagrange's polynomials of a table's Poisson's ratios at one, and their slopes, (p,) each."""
    power = np.arange(len(ratios))
    at = np.stack([nu**power, power * nu ** np.maximum(power - 1, 0)], axis=1)
    value, slope = np.linalg.solve(np.vander(ratios, increasing=True).T, at).T
    return value, slope


def mirrored(model: IndentationModel, point_m: NDArray, normal: NDArray) -> IndentationModel:
    """Model of the mirror image of the pressed point, for a solid that is its own image.

    Parameters
    ----------
    model : IndentationModel
    point_m, normal : (3,) arrays
        The mirror: a point of it [m] and its normal, of length 1.
    """
    turn = np.eye(3) - 2 * np.outer(normal, normal)
    shift = 2 * (point_m @ normal) * np.asarray(normal)
    moved = {
        "point_m": model.point_m @ turn + shift,
        "direction": model.direction @ turn,
        "surface_rest_m": model.surface_rest_m @ turn + shift,
        "surface_faces": model.surface_faces[:, [0, 2, 1]],
        "surface_displacement_m": model.surface_displacement_m @ turn.astype(np.float32),
    }
    return IndentationModel(**vars(model) | moved)


def save_indentation(path: str | Path, model: IndentationModel) -> None:
    """Write indentation-<point>.npz."""
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **vars(model) | {"laws": np.array(model.laws)})


def load_indentation(path: str | Path) -> IndentationModel:
    """Read indentation-<point>.npz.

    Raises
    ------
    ValueError
        If the file is no such archive, or an array is missing or of another shape.
    """
    arrays = read_npz(path, what="an indentation table")
    _check_shapes(path, arrays)
    plain = {
        "radius_m": float(arrays["radius_m"]),
        "laws": tuple(str(law) for law in arrays["laws"]),
    }
    return IndentationModel(**{name: arrays[name] for name in SHAPES} | plain)


def _check_shapes(path: str | Path, arrays: dict[str, NDArray]) -> None:
    missing = [name for name in SHAPES if name not in arrays]
    if missing:
        raise ValueError(f"{path}: {missing[0]}: expected an array, found none")
    sizes: dict[str, int] = {}
    for name, wanted in SHAPES.items():
        found = arrays[name].shape
        fits = len(found) == len(wanted) and all(
            size == (side if isinstance(side, int) else sizes.setdefault(side, size))
            for size, side in zip(found, wanted, strict=True)
        )
        if not fits:
            raise ValueError(f"{path}: {name}: expected shape {wanted}, found {found}")
