"""E_track and E_sm of one mesh (Eq. 4.25), and their descent by blocks.

A vertex moves to A_i p_i = p_i + R(r_i, phi_i) t_i (Eq. 4.23). For given axes and angles the energy
is quadratic in the translations and is solved exactly; angles take a Gauss-Newton step that is cut
until the energy falls; axes, which only the data term knows, take one vertex by vertex.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thesis.tracker.smoothness import HOLD, RADIAN_M, Smoothness, Transforms, turned

HALVINGS = 8
# Of the two by two systems of the axes, relative to their trace.
DAMPING = 1e-6


@dataclass(frozen=True)
class Data:
    """What the data term draws each vertex to.

    Attributes
    ----------
    rest_m, target_m, normals : (n, 3) arrays
        p_i, N(p_i) [m] and the unit normal there.
    weights : (n,) array
        w_data w_i.
    along : (n,) bool array
        Vertices whose distance counts along the normal only; else in all directions (Eq. 4.25).
    """

    rest_m: NDArray
    target_m: NDArray
    normals: NDArray
    weights: NDArray
    along: NDArray

    def gaps(self, displacement_m: NDArray) -> NDArray:
        """Distance of each vertex to its data, as the data term measures it, shape (n,) [m]."""
        return np.linalg.norm(self.counted(self.rest_m + displacement_m - self.target_m), axis=1)

    def counted(self, vectors: NDArray) -> NDArray:
        """The part of each vertex's vector (n, 3) that counts."""
        if not self.along.any():
            return vectors
        part = self.normals * (vectors * self.normals).sum(axis=1)[:, None]
        return np.where(self.along[:, None], part, vectors)


def energy(transforms: Transforms, data: Data, smoothness: Smoothness, w_sm: float) -> float:
    """E_track of Eq. 4.25 for given nearest neighbours [m2]."""
    gaps = data.gaps(transforms.displacement_m)
    return float(data.weights @ gaps**2) + w_sm * smoothness.energy(transforms)


def descend(
    transforms: Transforms, data: Data, smoothness: Smoothness, w_sm: float, *, rotations: bool
) -> tuple[Transforms, float]:
    """Lower E_track for given nearest neighbours: translations, then angles, then axes.

    Parameters
    ----------
    transforms : Transforms
        Where to start.
    data : Data
    smoothness : Smoothness
    w_sm : float
    rotations : bool
        Without, angles and axes stay: translations alone find the minimum.

    Returns
    -------
    transforms : Transforms
    energy : float
        E_track after the descent; never above that of the start [m2].
    """
    transforms = move(transforms, data, smoothness, w_sm)
    if rotations:
        transforms = turn(transforms, data, smoothness, w_sm)
        transforms = tilt(transforms, data)
    return transforms, energy(transforms, data, smoothness, w_sm)


def move(transforms: Transforms, data: Data, smoothness: Smoothness, w_sm: float) -> Transforms:
    """Translations that minimise E_track for given axes, angles and nearest neighbours.

    Of ||R t - d|| the turn goes over to d, and in the distance along a normal to the normal.
    """
    weights, hold = data.weights[:, None], HOLD * max(data.weights.max(initial=0.0), w_sm)
    target = turned(transforms, data.counted(data.target_m - data.rest_m), back=True)
    right = weights * target + hold * transforms.shift_m
    if not data.along.any():
        blocks = (weights + hold)[:, :, None]
        return replace(transforms, shift_m=smoothness.system(1).solve(blocks, w_sm, right))
    normals = turned(transforms, data.normals, back=True)
    counted = normals[:, :, None] * normals[:, None, :]
    counted = np.where(data.along[:, None, None], counted, np.eye(3))
    blocks = weights[:, :, None] * counted + hold * np.eye(3)
    shift = smoothness.system(3).solve(blocks, w_sm, right.reshape(-1, 1)).reshape(-1, 3)
    return replace(transforms, shift_m=shift)


def turn(transforms: Transforms, data: Data, smoothness: Smoothness, w_sm: float) -> Transforms:
    """Gauss-Newton step of the angles, halved until E_track does not rise."""
    moved = transforms.displacement_m
    slopes = data.counted(np.cross(transforms.axes, moved))
    gap = data.rest_m + moved - data.target_m
    curvature = data.weights * (slopes**2).sum(axis=1)
    slope = data.weights * (slopes * gap).sum(axis=1)
    slope += w_sm * smoothness.angle_slope(transforms.angle)
    w_angle = w_sm * RADIAN_M**2
    blocks = (curvature + HOLD * w_angle)[:, None, None]
    step = -smoothness.system(1).solve(blocks, w_angle, slope[:, None])[:, 0]
    before = energy(transforms, data, smoothness, w_sm)
    for part in 0.5 ** np.arange(HALVINGS):
        tried = replace(transforms, angle=transforms.angle + part * step)
        if energy(tried, data, smoothness, w_sm) <= before:
            return tried
    return transforms


def tilt(transforms: Transforms, data: Data) -> Transforms:
    """Gauss-Newton step of each axis, kept where the vertex comes no farther from its data."""
    r, t, angle = transforms.axes, transforms.shift_m, transforms.angle[:, None]
    moved = transforms.displacement_m
    gap = data.rest_m + moved - data.target_m
    sideways = _tangents(r)
    slopes = []
    for b in sideways:
        crossed = np.sin(angle) * np.cross(b, t)
        lifted = b * (r * t).sum(axis=1)[:, None] + r * (b * t).sum(axis=1)[:, None]
        slopes.append(data.counted(crossed + (1 - np.cos(angle)) * lifted))
    J = np.stack(slopes, axis=-1)
    H = np.einsum("nca,ncb->nab", J, J)
    H += (DAMPING * np.trace(H, axis1=1, axis2=2) + 1e-30)[:, None, None] * np.eye(2)
    slope = np.einsum("nca,nc->na", J, gap)
    step = -np.linalg.solve(H, slope[:, :, None])[:, :, 0]
    axes = r + step[:, :1] * sideways[0] + step[:, 1:] * sideways[1]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    tried = replace(transforms, axes=axes)
    better = (data.weights > 0) & (data.gaps(tried.displacement_m) < data.gaps(moved))
    return replace(transforms, axes=np.where(better[:, None], axes, r))


def _tangents(axes: NDArray) -> tuple[NDArray, NDArray]:
    """Two unit vectors across each axis."""
    least = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    first = np.cross(axes, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(axes, first)
