"""The probe with its board, and other boards, as parts of a scene."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from virtual_lab.part import BOARD, GRIP, METAL, SPHERE, Finish, Part
from virtual_lab.probe_board import Board
from virtual_lab.tagged_board import tagged_board

# Linear reflectance and gloss of the plain parts.
STONE = Finish((0.30, 0.29, 0.28), 0.02)
STEEL = Finish((0.34, 0.35, 0.37), 0.35)
RUBBER = Finish((0.05, 0.05, 0.06), 0.06)
PAPER = Finish((0.80, 0.80, 0.80), 0.0)
# Parts of the probe along its axis from the tip's centre, upward: start, stop, radius [m].
STEM = (0.004, 0.038, 0.0035)
NANO25 = (0.038, 0.060, 0.0125)
# The board leans over the axis: a longer handle would pierce it.
HANDLE = (0.060, 0.186, 0.0110)
# A hand holds the handle here, and so thick is the forearm behind it.
HAND_M, FOREARM_RADIUS_M = (0.0, 0.0, -0.120), 0.040
SKIN = Finish((0.45, 0.28, 0.20), 0.05)


@dataclass(frozen=True)
class Probe:
    """The probe's parts, force axes with the tip's centre as origin.

    Attributes
    ----------
    parts : tuple of Part
    board : Board
    tip_from_marker : (4, 4) array
    """

    parts: tuple[Part, ...]
    board: Board
    tip_from_marker: NDArray

    def outline(self) -> NDArray:
        """Vertices of all parts, shape (n, 3) [m]."""
        return np.concatenate([part.vertices_m for part in self.parts])


def make_board(marker: Mapping) -> Board:
    """Make the board of a ``marker`` block.

    Raises
    ------
    ValueError
        If the lab has no such board.
    """
    kind = marker.get("kind", "checkerboard")
    if kind == "charuco":
        return tagged_board(marker)
    if kind != "checkerboard":
        raise ValueError(f"marker.kind: expected checkerboard or charuco in the lab, found {kind}")
    columns, rows = marker["inner_corners"]
    return Board((columns + 1, rows + 1), marker["square_m"])


def make_probe(probe: Mapping, elbow_m: Sequence[float] | None = None) -> Probe:
    """Build the probe from its file; with an elbow (3,) [m], of the arm that holds it."""
    board = make_board(probe["marker"])
    marker_from_tip = np.array(probe["marker_from_force"]) @ np.array(probe["force_from_tip"])
    tip_from_marker = np.linalg.inv(marker_from_tip)
    ball = trimesh.creation.icosphere(subdivisions=4, radius=probe["indenter"]["radius_m"])
    vertices, faces = board.mesh()
    parts = (
        *(() if elbow_m is None else (_forearm(elbow_m),)),
        Part(SPHERE, ball.vertices, ball.faces, STONE),
        Part(METAL, *_cylinder(*STEM), STEEL),
        Part(METAL, *_cylinder(*NANO25), STEEL),
        Part(GRIP, *_cylinder(*HANDLE), RUBBER),
        Part(BOARD, _moved(vertices, tip_from_marker), faces, PAPER),
    )
    return Probe(parts, board, tip_from_marker)


def _forearm(elbow_m: Sequence[float]) -> Part:
    arm = trimesh.creation.cylinder(FOREARM_RADIUS_M, segment=[HAND_M, elbow_m])
    return Part(GRIP, arm.vertices, arm.faces, SKIN)


def loose_board(board: Board) -> Probe:
    """A board in nobody's hand: its parts in its own frame."""
    vertices, faces = board.mesh()
    return Probe((Part(BOARD, vertices, faces, PAPER),), board, np.eye(4))


def _moved(vertices: NDArray, transform: NDArray) -> NDArray:
    return vertices @ transform[:3, :3].T + transform[:3, 3]


def _cylinder(start: float, stop: float, radius: float) -> tuple:
    mesh = trimesh.creation.cylinder(radius=radius, height=stop - start, sections=96)
    return mesh.vertices + [0, 0, -(start + stop) / 2], mesh.faces
