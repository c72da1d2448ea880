"""What a frame is tracked against, and the data point N(p_i) of each vertex."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from palpate.surface.pose import data_weights
from palpate.surface.template import Template, vertex_normals
from scipy.spatial import cKDTree

from thesis.tracker.options import Registration

# Data points that a mean is made of, at most, and how far it reaches in edge lengths.
MEAN_OF = 32
MEAN_REACH = 1.0
# It is made where most normals are as much like that of the point in the middle.
FLAT_DEG, FLAT_PART = 30.0, 0.9


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


@dataclass(frozen=True)
class Frame:
    """What a frame is tracked against, camera frame.

    Attributes
    ----------
    points_m, normals : (n, 3) arrays
        Captured points and added ones [m].
    captured : int
        The first so many points were captured.
    owners : (k,) int array, optional
        The last k points are places of single vertices, and these their numbers: unlike points of
        a surface, a place holds its own vertex in all directions.
    """

    points_m: NDArray
    normals: NDArray
    captured: int
    owners: NDArray = field(default_factory=lambda: np.zeros(0, dtype=int))


class DataPoints:
    """A frame's points, to find nearest ones.

    Parameters
    ----------
    frame : Frame
    options : Registration
    """

    def __init__(self, frame: Frame, options: Registration) -> None:
        self.frame, self.options = frame, options
        self.tree = cKDTree(frame.points_m)
        self.least_cosine = np.cos(np.deg2rad(options.largest_normal_deg))

    def nearest(
        self, template: Template, displacement_m: NDArray, numbers: NDArray
    ) -> tuple[Data, NDArray]:
        """Nearest data points N(p_i), their weights, and which of them were captured.

        Parameters
        ----------
        template : Template
            Of a level, camera frame.
        displacement_m : (n, 3) array
            Of its vertices [m].
        numbers : (n,) int array
            Their numbers in the finest mesh.
        """
        frame, options = self.frame, self.options
        placed = template.vertices_m + displacement_m
        weights, nearest, _ = data_weights(
            placed,
            vertex_normals(placed, template.faces),
            self.tree,
            frame.normals,
            options.largest_distance_m,
            self.least_cosine,
        )
        along = np.full(len(placed), options.data_term == "plane")
        if options.data_term == "plane":
            own, place = self._own_places(placed, numbers)
            weights[own], nearest[own], along[own] = True, place, False
        target, normals = frame.points_m[nearest], frame.normals[nearest]
        if options.data_points == "mean":
            mean = np.flatnonzero(weights & (nearest < frame.captured))
            reach = MEAN_REACH * _edge_reach(placed, template.faces)[mean]
            target[mean], normals[mean] = self._means(nearest[mean], reach)
        data = Data(template.vertices_m, target, normals, options.w_data * weights, along)
        return data, nearest < frame.captured

    def _own_places(self, placed: NDArray, numbers: NDArray) -> tuple[NDArray, NDArray]:
        """Vertices with a place of their own within reach, and the number of its point."""
        first = len(self.frame.points_m) - len(self.frame.owners)
        place = np.full(max(numbers.max(), self.frame.owners.max(initial=0)) + 1, -1)
        place[self.frame.owners] = first + np.arange(len(self.frame.owners))
        own = np.flatnonzero(place[numbers] >= 0)
        place = place[numbers[own]]
        gap = np.linalg.norm(placed[own] - self.frame.points_m[place], axis=1)
        near = gap < self.options.largest_distance_m
        return own[near], place[near]

    def _means(self, nearest: NDArray, reach_m: NDArray) -> tuple[NDArray, NDArray]:
        """Data points at the mean height of those around, unless they lie on an edge."""
        # On a curved surface points lie below the tangent plane as far as their own lie above
        # it: the mean of both heights is right to second order.
        frame = self.frame
        count = min(MEAN_OF, len(frame.points_m))
        distance, around = self.tree.query(frame.points_m[nearest], k=[*range(1, count + 1)])
        points, normals = frame.points_m[around], frame.normals[around]
        near = distance <= reach_m[:, None]
        cosine = np.einsum("kpc,kc->kp", normals, frame.normals[nearest])
        alike = cosine > np.cos(np.deg2rad(FLAT_DEG))
        # Across an edge of the object a mean would lie inside.
        flat = (alike & near).sum(axis=1) >= FLAT_PART * near.sum(axis=1)
        part = (near & flat[:, None]).astype(float)
        part[:, 0] = 1.0
        mean = np.einsum("kp,kpc->kc", part, normals)
        mean /= np.linalg.norm(mean, axis=1, keepdims=True)
        offset = points - frame.points_m[nearest][:, None]
        below = np.einsum("kpc,kc->kp", offset, mean)
        steepness = np.maximum(np.einsum("kpc,kc->kp", normals, mean), self.least_cosine)
        above = np.einsum("kpc,kpc->kp", offset, normals) / steepness
        height = (part * (below + above) / 2).sum(axis=1) / part.sum(axis=1)
        return frame.points_m[nearest] + height[:, None] * mean, mean


def _edge_reach(vertices: NDArray, faces: NDArray) -> NDArray:
    """Mean length of each vertex's edges, shape (n,) [m]; all lie between two triangles."""
    sides = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, -1, axis=1)], axis=-1)
    ends = np.concatenate([faces.ravel(), np.roll(faces, -1, axis=1).ravel()])
    total = np.bincount(ends, np.tile(sides.ravel(), 2), len(vertices))
    return total / np.bincount(ends, minlength=len(vertices))
