"""Where a target's pixels lie on it, and how bright what is printed there is, blurred.

The derivatives leave out that a pixel's size on the target changes as that moves: it is small.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from palpate.vision.camera import PinholeCamera


class Blurred(NamedTuple):
    """Whiteness (0 to 1) of places, its derivatives by place, and by each blur, (n,) each."""

    white: NDArray
    by_u: NDArray
    by_v: NDArray
    by_blur_u: NDArray
    by_blur_v: NDArray


@dataclass(frozen=True)
class Print:
    """What is printed on a target: fields of black and white between straight lines.

    Attributes
    ----------
    u, v : (k,) and (l,) arrays
        Where the lines are, increasing [units of the target].
    white : (l + 1, k + 1) array
        1 where a field is white, 0 where it is black; the outer ones have no end.
    """

    u: NDArray
    v: NDArray
    white: NDArray

    def blurred(self, u: NDArray, v: NDArray, blur_u: NDArray, blur_v: NDArray) -> Blurred:
        """What a blur leaves of it.

        Parameters
        ----------
        u, v : (n,) arrays
            Places [units].
        blur_u, blur_v : (n,) arrays
            Standard deviations of the blur there [units].
        """
        (a, da, sa), (b, db, sb) = _parts(u, self.u, blur_u), _parts(v, self.v, blur_v)
        along, down = b @ self.white, a @ self.white.T
        return Blurred(
            np.einsum("ij,ij->i", along, a),
            np.einsum("ij,ij->i", along, da),
            np.einsum("ij,ij->i", down, db),
            np.einsum("ij,ij->i", along, sa),
            np.einsum("ij,ij->i", down, sb),
        )

    def at(self, u: NDArray, v: NDArray) -> NDArray:
        """Whiteness of places (n,), not blurred."""
        return self.white[np.searchsorted(self.v, v), np.searchsorted(self.u, u)]


def _parts(place: NDArray, lines: NDArray, blur: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Shares (n, k + 1) of the fields between lines, and their derivatives by place and blur."""
    z = (place[:, None] - lines) / blur[:, None]
    beyond = (1 + erf(z / np.sqrt(2))) / 2
    bell = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) / blur[:, None]
    steps = ((beyond, 1.0), (bell, 0.0), (-bell * z, 0.0))
    return tuple(-np.diff(step, axis=1, prepend=first, append=0.0) for step, first in steps)


def place_derivatives(
    u: NDArray, v: NDArray, w: NDArray, inverse: NDArray, pose: NDArray, unit_m: float
) -> tuple[NDArray, NDArray]:
    """Derivatives of u and v by rotation vector and shift of the target, (n, 6) each."""
    x, y, z = pose[:3, :2] @ (np.stack([u, v]) * w * unit_m)
    dw = [
        np.stack([z * b - y * c, x * c - z * a, y * a - x * b, -w * a, -w * b, -w * c])
        for a, b, c in inverse
    ]
    return tuple(((dw[k] - place * dw[2]) / w).T for k, place in ((0, u), (1, v)))


def pixel_sizes(
    u: NDArray, v: NDArray, w: NDArray, inverse: NDArray, camera: PinholeCamera
) -> tuple[NDArray, NDArray]:
    """Units of the target per pixel across lines of constant u and of constant v, (n,) each."""
    sizes = []
    for k, place in ((0, u), (1, v)):
        across, down = (
            (inverse[k, axis] - place * inverse[2, axis]) / w * (1 / focal)
            for axis, focal in ((0, camera.fx_px), (1, camera.fy_px))
        )
        sizes.append(np.sqrt(across**2 + down**2))
    return tuple(sizes)
