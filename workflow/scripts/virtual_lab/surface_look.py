"""Normals, reflectances and highlights at the points that rays hit."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from virtual_lab.part import BOARD, OBJECT, SPHERE, TABLE
from virtual_lab.scene import Scene, barycentric, dot, unit
from virtual_lab.texture import TABLE_SIZE_M, TABLE_STEP_M, look_up


@dataclass(frozen=True)
class Look:
    """What shading needs at hits.

    Attributes
    ----------
    normals : (n, 3) array
    colours : (n, 3) array
        Linear reflectance.
    gloss, shininess : (n,) arrays
        Strength and exponent of the highlight.
    """

    normals: NDArray
    colours: NDArray
    gloss: NDArray
    shininess: NDArray


def look_at_hits(
    scene: Scene, hits: dict, points: NDArray, directions: NDArray, footprint: float
) -> Look:
    """Look up normals and finishes at hits.

    Parameters
    ----------
    scene : Scene
    hits : dict
        Of `Scene.cast`.
    points, directions : (n, 3) arrays
        Where the rays hit [m], and their unit directions.
    footprint : float
        Width of a ray over its length.
    """
    kind, normals = hits["kind"], hits["normal"].copy()
    finishes = scene.finishes
    colours = np.array([f.colour for f in finishes])[hits["part"]]
    gloss = np.array([f.gloss for f in finishes])[hits["part"]]
    shininess = np.array([f.shininess for f in finishes])[hits["part"]]
    table = kind == TABLE
    if table.any():
        colours[table] = _table_colour(scene.bench.table, points[table])
    body = kind == OBJECT
    if body.any():
        paint = scene.bench.paint
        colours[body] = paint.colour(barycentric(hits, body, scene.faces, scene.rest_m))
        gloss[body], shininess[body] = paint.gloss, paint.shininess
        normals[body] = unit(barycentric(hits, body, scene.faces, scene.normals))
    ball = kind == SPHERE
    if ball.any():
        normals[ball] = unit(points[ball] - scene.tip_m)
    board = kind == BOARD
    if board.any():
        colours[board] = _board_colour(scene, hits, points, directions, normals, footprint)
    return Look(normals, colours, gloss, shininess)


def _table_colour(table: NDArray, points: NDArray) -> NDArray:
    place = (points[:, :2] + TABLE_SIZE_M / 2) / TABLE_STEP_M
    return look_up(table, place[:, 0], place[:, 1])


def _board_colour(
    scene: Scene,
    hits: dict,
    points: NDArray,
    directions: NDArray,
    normals: NDArray,
    footprint: float,
) -> NDArray:
    chosen = hits["kind"] == BOARD
    local = (points[chosen] - scene.tip_m) @ scene.object_from_force
    transform = scene.probe.tip_from_marker
    slant = np.abs(dot(normals[chosen], directions[chosen]))
    width = hits["t"][chosen] * footprint / np.sqrt(np.maximum(slant, 0.1))
    return scene.probe.board.colour((local - transform[:3, 3]) @ transform[:3, :3], width)
