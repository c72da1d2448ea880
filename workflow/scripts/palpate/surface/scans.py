"""Template from laser scans: registration, merging and a watertight surface (Section 4.1.1)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyvista as pv
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from palpate.capture.images import read_cloud
from palpate.solid.mesh import at_nodes
from palpate.surface.template import decimated

# Joint point-to-plane registration of all views: reach of a correspondence in each step [m].
REACHES_M = (*6 * (0.006,), *4 * (0.003,), *4 * (0.0015,), *4 * (0.001,))
SAMPLES = 2500
LEAST_COSINE = 0.7
# Relative to the normal equations' strongest direction: those that nothing fixes do not move.
DAMPING = 2e-4
NEIGHBOURS = 16
# Scale of the average over neighbours, in grid spacings.
SMOOTHING = 0.8
PADDING = 4
# Nodes of the grid that fit a gigabyte, and how many are looked at at a time.
MOST_NODES, CHUNK = 12_000_000, 100_000
# Samples so near, and so little off a plane, are of its sheet, in grid spacings.
VOTE_REACH, SHEET = 1.5, 0.5
# Mean cosine between a sample's normal and those of its sheet.
LEAST_AGREEMENT = 0.5
LEAST_OVERLAP = 0.2
# Turns and shifts are rounded far below what the scans determine and far above a processor's own
# rounding: thinning the surface makes another mesh of it for the last bit of a point.
DECIMALS = 9


def read_scans(folder: str | Path, *, unit: str = "m") -> list[tuple[NDArray, NDArray]]:
    """Read the views ``*.ply`` of a folder: points (n, 3) [m] and unit normals (n, 3).

    Parameters
    ----------
    folder : path
    unit : {"m", "mm"}, optional
        Unit of the coordinates.

    Raises
    ------
    ValueError
        If there is no view, or one has no points or no normals.
    """
    files = sorted(Path(folder).glob("*.ply"))
    if not files:
        raise ValueError(f"{folder}: scans: expected PLY files, found none")
    views = []
    for file in files:
        views.append(read_cloud(file, unit))
        if views[-1].normals is None:
            raise ValueError(f"{file}: points: expected points with normals, found none")
    return views


def template_from_scans(
    views: Sequence[tuple[NDArray, NDArray]], *, vertices: int, spacing_m: float
) -> trimesh.Trimesh:
    """Make a closed surface from overlapping views in a nominal frame.

    The first view stays where it is and defines the frame.

    Parameters
    ----------
    views : sequence of (points (n, 3) [m], normals (n, 3))
    vertices : int
        Wanted number of vertices.
    spacing_m : float
        Edge of the grid on which the surface is found; finer details are lost [m].

    Returns
    -------
    trimesh.Trimesh
        Watertight, outward.

    Raises
    ------
    ValueError
        If a view does not overlap the others or no closed surface comes out.
    """
    thinned = [_thinned(points, normals, spacing_m / 2) for points, normals in views]
    placed = register([view[:2] for view in thinned])
    merged = _thinned(
        np.concatenate([points for points, _ in placed]),
        np.concatenate([normals for _, normals in placed]),
        spacing_m,
        np.concatenate([counts for _, _, counts in thinned]),
    )
    kept = _not_outvoted(*merged, spacing_m)
    mesh = decimated(implicit_surface(*kept, spacing_m), vertices)
    if not mesh.is_watertight or mesh.volume <= 0:
        raise ValueError("scans: expected a closed surface after decimation, found an open one")
    return mesh


def register(views: Sequence[tuple[NDArray, NDArray]]) -> list[tuple[NDArray, NDArray]]:
    """Move all views but the first so that they agree where they overlap.

    Gauss-Newton on the point-to-plane distances of all pairs of views at once, so that no view
    drifts away from the first.

    Parameters
    ----------
    views : sequence of (points (n, 3) [m], unit normals (n, 3))

    Returns
    -------
    list of (points, normals)

    Raises
    ------
    ValueError
        If a view does not overlap the others.
    """
    count = len(views)
    middle = np.mean([points.mean(axis=0) for points, _ in views], axis=0)
    trees = [cKDTree(points) for points, _ in views]
    turns, shifts = [Rotation.identity() for _ in views], np.zeros((count, 3))
    for reach in REACHES_M:
        matrix, load = np.zeros((6 * count, 6 * count)), np.zeros(6 * count)
        for i in range(count):
            step = max(1, len(views[i][0]) // SAMPLES)
            chosen, facing = views[i][0][::step], views[i][1][::step]
            placed = turns[i].apply(chosen - middle) + shifts[i]
            facing = turns[i].apply(facing)
            met = np.zeros(len(chosen), dtype=bool)
            for j in range(count):
                if j == i:
                    continue
                local = turns[j].inv().apply(placed - shifts[j]) + middle
                away, near = trees[j].query(local, distance_upper_bound=reach)
                found = np.flatnonzero(np.isfinite(away))
                normals = turns[j].apply(views[j][1][near[found]])
                found_normals = (normals * facing[found]).sum(axis=1) > LEAST_COSINE
                found, normals = found[found_normals], normals[found_normals]
                target = turns[j].apply(views[j][0][near[found]] - middle) + shifts[j]
                residual, J = _plane_offsets(placed[found], target, normals)
                place = np.r_[6 * i : 6 * i + 6, 6 * j : 6 * j + 6]
                matrix[np.ix_(place, place)] += J.T @ J
                load[place] -= J.T @ residual
                met[found] = True
            if met.mean() < LEAST_OVERLAP:
                expected = f"expected an overlap >= {LEAST_OVERLAP}, found {met.mean():.2f}"
                raise ValueError(f"scans: view {i + 1}: {expected}")
        for k, move in enumerate(_solved(matrix, load), start=1):
            turn = Rotation.from_rotvec(move[:3])
            turns[k], shifts[k] = turn * turns[k], turn.apply(shifts[k]) + move[3:]
    turns = [Rotation.from_rotvec(np.round(turn.as_rotvec(), DECIMALS)) for turn in turns]
    shifts = np.round(shifts, DECIMALS)
    return [
        (turns[k].apply(points - middle) + shifts[k] + middle, turns[k].apply(normals))
        for k, (points, normals) in enumerate(views)
    ]


def _plane_offsets(source: NDArray, target: NDArray, normals: NDArray) -> tuple[NDArray, NDArray]:
    """Offsets n . (T_i p - T_j q) along normals n, and slopes by small motions of both views."""
    J = np.hstack([np.cross(source, normals), normals, -np.cross(target, normals), -normals])
    return ((source - target) * normals).sum(axis=1), J


def _solved(matrix: NDArray, load: NDArray) -> NDArray:
    """Small motions (turn vector, shift) of the views but the first, which rests, (v - 1, 6)."""
    free = matrix[6:, 6:].copy()
    # Turns and shifts of a view apart: the strongest direction sets the scale of the weakest.
    parts = np.diag(free).reshape(-1, 3)
    free[np.diag_indices_from(free)] += DAMPING * np.repeat(parts.max(axis=1), 3)
    return np.linalg.solve(free, load[6:]).reshape(-1, 6)


def implicit_surface(
    points_m: NDArray, normals: NDArray, weights: NDArray, spacing_m: float
) -> trimesh.Trimesh:
    """Zero level of distances to local tangent planes, averaged over neighbours (IMLS).

    Parameters
    ----------
    points_m, normals : (n, 3) arrays
        Oriented samples of a closed surface.
    weights : (n,) array
        Of the samples.
    spacing_m : float
        Edge of the grid [m].
    """
    low = points_m.min(axis=0) - PADDING * spacing_m
    counts = np.ceil((points_m.max(axis=0) + PADDING * spacing_m - low) / spacing_m).astype(int) + 1
    if (nodes := float(np.prod(counts, dtype=float))) > MOST_NODES:
        expected = f"expected {spacing_m * (nodes / MOST_NODES) ** (1 / 3):.2g} m or more"
        raise ValueError(
            f"scans: spacing_m: {expected} for their size, found {spacing_m:g} m"
            f" ({nodes / 1e6:.0f} million nodes)"
        )
    axes = [low[k] + spacing_m * np.arange(counts[k]) for k in range(3)]
    # VTK counts along x first.
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    nodes = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    values = _plane_distance(nodes, points_m, normals, weights, SMOOTHING * spacing_m)
    grid = pv.ImageData(dimensions=tuple(counts), spacing=(spacing_m,) * 3, origin=tuple(low))
    contour = grid.contour([0.0], scalars=values, method="flying_edges")
    contour = contour.connectivity("largest").extract_surface(algorithm="dataset_surface")
    faces = contour.faces.reshape(-1, 4)[:, 1:]
    mesh = trimesh.Trimesh(np.asarray(contour.points, dtype=float), faces, process=False)
    if not mesh.is_watertight:
        raise ValueError("scans: expected views that close the surface, found holes")
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def _thinned(
    points: NDArray, normals: NDArray, edge: float, counts: NDArray | None = None
) -> tuple[NDArray, NDArray, NDArray]:
    """Means over voxels of points that face about the same way, and how many points they have."""
    counts = np.ones(len(points)) if counts is None else counts
    side = np.argmax(np.abs(normals), axis=1)
    side = 2 * side + (np.take_along_axis(normals, side[:, None], axis=1)[:, 0] > 0)
    cells = np.floor((points - points.min(axis=0)) / edge).astype(np.int64)
    sizes = cells.max(axis=0) + 1
    keys = ((cells[:, 0] * sizes[1] + cells[:, 1]) * sizes[2] + cells[:, 2]) * 6 + side
    _, group = np.unique(keys, return_inverse=True)
    total = np.bincount(group, counts)
    points, normals = (
        at_nodes(group, counts[:, None] * values, len(total)) / total[:, None]
        for values in (points, normals)
    )
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True), total


def _not_outvoted(
    points: NDArray, normals: NDArray, counts: NDArray, spacing_m: float
) -> tuple[NDArray, NDArray, NDArray]:
    """Samples that face about as those of the same sheet do.

    At the rim of a view rays graze the surface, and noise turns normals away or to the other side.
    Samples vote on those that lie in their plane; the other side of a thin part does not.
    """
    pairs = cKDTree(points).query_pairs(VOTE_REACH * spacing_m, output_type="ndarray").T
    agreed, votes = counts.copy(), counts.copy()
    for i, j in (pairs, pairs[::-1]):
        offset = np.abs(((points[j] - points[i]) * normals[j]).sum(axis=1))
        voting = np.where(offset < SHEET * spacing_m, counts[j], 0.0)
        agreement = (normals[i] * normals[j]).sum(axis=1)
        agreed += np.bincount(i, voting * agreement, len(points))
        votes += np.bincount(i, voting, len(points))
    kept = agreed > LEAST_AGREEMENT * votes
    return points[kept], normals[kept], counts[kept]


def _plane_distance(
    nodes: NDArray, points: NDArray, normals: NDArray, counts: NDArray, scale: float
) -> NDArray:
    tree, found = cKDTree(points), []
    for part in np.array_split(nodes, -(-len(nodes) // CHUNK)):
        away, near = tree.query(part, k=NEIGHBOURS)
        offsets = np.einsum("nki,nki->nk", part[:, None] - points[near], normals[near])
        # Relative to the nearest sample, so that weights far from the surface don't vanish.
        weights = np.exp(-(away**2 - away[:, :1] ** 2) / (2 * scale**2 + away[:, :1] ** 2))
        weights = weights * counts[near]
        found.append((weights * offsets).sum(axis=1) / weights.sum(axis=1))
    return np.concatenate(found)
