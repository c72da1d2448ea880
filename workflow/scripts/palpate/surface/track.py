"""The study's tracker: the template deformed to every frame by E_track (Eq. 4.23-4.25).

A vertex moves to A_i p_i = p_i + R(r_i, phi_i) t_i. The study starts from identity, where axis and
angle are zero: there neither the data nor the smoothness term has a slope in them, so they stay,
and E_track is quadratic in the translations for given nearest neighbours. It is solved exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from palpate.surface.pose import data_weights
from palpate.surface.template import Template, neighbourhoods, vertex_normals
from palpate.surface.tracked import Frame as Frame
from palpate.surface.tracked import Tracked as Tracked
from palpate.surface.tracked import load_tracked as load_tracked
from palpate.surface.tracked import save_tracked as save_tracked

# Section 4.3.1: the optimisation stops when the energy changes by less, relative to itself.
RELATIVE_CHANGE = 1e-4


@dataclass(frozen=True)
class TrackerOptions:
    """Parameters of Eq. 4.25 (Section 5.2.1).

    Attributes
    ----------
    w_data, w_sm, w_sm_stop : float
        Weight of the data term; first weight of the smoothness term, halved in each iteration
        until it is below the last.
    s_sm : float
        Radius of the smoothness, in edges or average edge lengths.
    neighbourhood : {"rings", "geodesic"}
    data_term : {"point", "plane"}
        Distance to the nearest data point as in Eq. 4.25, or along its normal.
    largest_distance_m, largest_normal_deg : float
        dr and angle threshold of the weights.
    """

    w_data: float
    w_sm: float
    w_sm_stop: float
    s_sm: float
    neighbourhood: str
    data_term: str
    largest_distance_m: float
    largest_normal_deg: float


def track_frames(
    template: Template, rest_m: NDArray, frames: Sequence[Frame], options: TrackerOptions
) -> tuple[NDArray, NDArray, NDArray]:
    """Deform the aligned template to each frame, starting from the frame before.

    Parameters
    ----------
    template : Template
    rest_m : (n, 3) array
        Its vertices in the camera frame [m].
    frames : sequence of Frame
    options : TrackerOptions

    Returns
    -------
    vertices_m : (f, n, 3) array
    observed : (f, n) bool array
    residual_m : (f,) array
    """
    smoothness = smoothness_matrix(template, options)
    shift = np.zeros_like(rest_m)
    vertices, observed, residuals = [], [], []
    for number, frame in enumerate(frames):
        shift, seen, residual = track_frame(
            template.faces, rest_m, shift, frame, smoothness, options
        )
        if not seen.any():
            raise ValueError(
                f"frame {number}: expected captured points near the template, found none"
            )
        vertices.append(rest_m + shift)
        observed.append(seen)
        residuals.append(residual)
    return np.array(vertices), np.array(observed), np.array(residuals)


def track_frame(
    faces: NDArray,
    rest_m: NDArray,
    shift_m: NDArray,
    frame: Frame,
    smoothness: sparse.csr_matrix,
    options: TrackerOptions,
) -> tuple[NDArray, NDArray, float]:
    """Minimise E_track for one frame from a first translation of each vertex.

    Returns
    -------
    shift_m : (n, 3) array
        Translations t_i [m].
    observed : (n,) bool array
    residual_m : float
    """
    tree = cKDTree(frame.points_m)
    least_cosine = np.cos(np.deg2rad(options.largest_normal_deg))
    w_sm, before, seen, residual = options.w_sm, np.inf, np.zeros(len(rest_m), bool), np.nan
    while w_sm >= options.w_sm_stop:
        placed = rest_m + shift_m
        weights, nearest, _ = data_weights(
            placed,
            vertex_normals(placed, faces),
            tree,
            frame.normals,
            options.largest_distance_m,
            least_cosine,
        )
        target, normals = frame.points_m[nearest], frame.normals[nearest]
        shift_m = _minimise(rest_m, shift_m, target, normals, weights, smoothness, w_sm, options)
        gap = _gaps(rest_m + shift_m, target, normals, options.data_term)
        energy = options.w_data * (gap[weights] ** 2).sum()
        energy += w_sm * (shift_m * (smoothness @ shift_m)).sum()
        seen = weights & (nearest < frame.captured)
        residual = float(np.sqrt(np.mean(gap[seen] ** 2))) if seen.any() else np.nan
        if np.isfinite(before) and abs(before - energy) < RELATIVE_CHANGE * before:
            break
        before, w_sm = energy, w_sm / 2
    return shift_m, seen, residual


def smoothness_matrix(template: Template, options: TrackerOptions) -> sparse.csr_matrix:
    """Matrix L of E_sm = sum over axes of t' L t, from the neighbourhoods R_sm (Eq. 4.25)."""
    near = neighbourhoods(template, reach=options.s_sm, measure=options.neighbourhood)
    counts = np.maximum(np.asarray(near.sum(axis=1)).ravel(), 1)
    weights = sparse.diags(1.0 / counts) @ near.astype(float)
    weights = weights + weights.T
    degree = np.asarray(weights.sum(axis=1)).ravel()
    return sparse.csr_matrix(sparse.diags(degree) - weights)


def _minimise(
    rest: NDArray,
    shift: NDArray,
    target: NDArray,
    normals: NDArray,
    weights: NDArray,
    smoothness: sparse.csr_matrix,
    w_sm: float,
    options: TrackerOptions,
) -> NDArray:
    """Translations that minimise E_track for given nearest neighbours."""
    data = options.w_data * weights
    # A piece of the mesh without any data stays where it was.
    hold = 1e-9 * max(options.w_data, w_sm)
    if options.data_term == "point":
        A = w_sm * smoothness + sparse.diags(data + hold)
        right = data[:, None] * (target - rest) + hold * shift
        return splu(sparse.csc_matrix(A)).solve(right)
    size = len(rest)
    outer = sparse.bsr_matrix(
        (
            data[:, None, None] * normals[:, :, None] * normals[:, None, :],
            np.arange(size),
            np.arange(size + 1),
        ),
        shape=(3 * size, 3 * size),
    )
    A = w_sm * sparse.kron(smoothness, sparse.eye(3)) + outer + hold * sparse.eye(3 * size)
    along = ((target - rest) * normals).sum(axis=1)
    right = (data * along)[:, None] * normals + hold * shift
    return splu(sparse.csc_matrix(A)).solve(right.ravel()).reshape(-1, 3)


def _gaps(placed: NDArray, target: NDArray, normals: NDArray, data_term: str) -> NDArray:
    """Distance of each vertex to its data, as the data term measures it, shape (n,) [m]."""
    gap = placed - target
    if data_term == "plane":
        return np.abs((gap * normals).sum(axis=1))
    return np.linalg.norm(gap, axis=1)
