"""Solid parts of the rig from its configuration: probe, sensors, table and object."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from thesis.chapter4.transform_chain import (
    HANDLE_M,
    HANDLE_RADIUS_M,
    NANO25_LENGTH_M,
    NANO25_RADIUS_M,
    STEM_RADIUS_M,
)

STONE, STEEL, DARK_STEEL, RUBBER = "#A9A29A", "#C3C9CF", "#8E979F", "#4A4F55"
BODY, LENS, GLASS = "#5A6068", "#22262B", "#7FA6C9"
WHITE, INK = "#F2F2F2", "#3A3A3A"
# Housings as drawn [m]: about the devices' width, height, length; nothing is computed from them.
HOUSINGS = {"stereo": (0.157, 0.036, 0.0474), "structured_light": (0.282, 0.038, 0.063)}
SCANNER_M = (0.213, 0.413, 0.271)
BOARD_MARGIN_M, BOARD_M = 0.016, 0.003
SECTIONS = 64


@dataclass(frozen=True)
class Shape:
    """Coloured surface.

    Attributes
    ----------
    vertices_m : (n, 3) array
    faces : (m, 3) int array
    colours : (n, 3) array
        Red, green and blue of the vertices, 0 to 1.
    """

    vertices_m: NDArray
    faces: NDArray
    colours: NDArray

    def moved(self, transform: NDArray) -> "Shape":
        """The shape after a rigid transform (4, 4)."""
        vertices = self.vertices_m @ transform[:3, :3].T + transform[:3, 3]
        return Shape(vertices, self.faces, self.colours)


def joined(shapes: Sequence[Shape]) -> Shape:
    """One shape of several.

    Raises
    ------
    ValueError
        If there is none.
    """
    if not shapes:
        raise ValueError("shapes: expected at least one, found none")
    starts = np.cumsum([0, *(len(shape.vertices_m) for shape in shapes[:-1])])
    faces = [shape.faces + start for shape, start in zip(shapes, starts, strict=True)]
    return Shape(
        np.concatenate([shape.vertices_m for shape in shapes]),
        np.concatenate(faces),
        np.concatenate([shape.colours for shape in shapes]),
    )


def box(size_m: Sequence[float], centre_m: Sequence[float], colour: str) -> Shape:
    """Block with sides along the axes."""
    mesh = trimesh.creation.box(extents=size_m)
    vertices = mesh.vertices + np.asarray(centre_m)
    return _painted(vertices[mesh.faces].reshape(-1, 3), _own(len(mesh.faces)), colour)


def cylinder(start_m: float, stop_m: float, radius_m: float, colour: str) -> Shape:
    """Cylinder about the z axis."""
    mesh = trimesh.creation.cylinder(radius_m, stop_m - start_m, sections=SECTIONS)
    vertices = mesh.vertices + [0, 0, (start_m + stop_m) / 2]
    # Corners of its own for each face: the rim stays sharp.
    return _painted(vertices[mesh.faces].reshape(-1, 3), _own(len(mesh.faces)), colour)


def probe_shape(probe: Mapping) -> Shape:
    """Sphere, stem, force sensor, handle and board of a probe, in the frame of its force sensor.

    Parameters
    ----------
    probe : mapping
        The probe's file. Handle and stem are sketched, the force sensor is ATI's Nano25.
    """
    centre = np.array(probe["force_from_tip"])[:3, 3]
    radius = probe["indenter"]["radius_m"]
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    upright = [
        cylinder(NANO25_LENGTH_M, centre[2] - 0.6 * radius, STEM_RADIUS_M, STEEL),
        cylinder(0.0, NANO25_LENGTH_M, NANO25_RADIUS_M, DARK_STEEL),
        cylinder(-HANDLE_M, 0.0, HANDLE_RADIUS_M, RUBBER),
    ]
    board = board_shape(probe["marker"]).moved(np.linalg.inv(probe["marker_from_force"]))
    return joined([_painted(ball.vertices + centre, ball.faces, STONE), *upright, board])


def board_shape(marker: Mapping) -> Shape:
    """Checkerboard in its own frame: a sheet with the squares on the side that is seen (-z)."""
    squares = np.array(marker["inner_corners"]) + 1
    side = marker["square_m"]
    size = squares * side + 2 * BOARD_MARGIN_M
    middle = (squares / 2 - 1) * side
    shapes = [box([*size, BOARD_M], [*middle, BOARD_M / 2], WHITE)]
    for column, row in np.ndindex(*squares):
        if (row + column) % 2 == 0:
            place = (np.array([column, row]) - 0.5) * side
            shapes.append(box([side, side, 0.0002], [*place, -0.0002], INK))
    return joined(shapes)


def stereo_shape(sensor: Mapping) -> tuple[Shape, dict[str, NDArray]]:
    """Housing of a stereo head, left camera's frame, and the centres of its optics [m]."""
    ends = {"left camera": 0.0, "right camera": sensor["stereo"]["baseline_m"]}
    places = {name: np.array([x, 0.0, 0.0]) for name, x in ends.items()}
    return _housing(HOUSINGS["stereo"], places, "#D9A441"), places


def structured_shape(sensor: Mapping) -> tuple[Shape, dict[str, NDArray]]:
    """Housing of a structured-light sensor, colour camera's frame, and its optics' centres [m]."""
    spec = sensor["depth"]
    color_from_depth = np.array(spec["color_from_depth"])
    places = {
        "infrared camera": color_from_depth[:3, 3],
        "colour camera": np.zeros(3),
        "infrared projector": (color_from_depth @ [spec["baseline_m"], 0, 0, 1])[:3],
    }
    return _housing(HOUSINGS["structured_light"], places, BODY), places


def sensor_shape(sensor: Mapping) -> tuple[Shape, dict[str, NDArray]]:
    """Housing of a sensor in its reference camera's frame, and the centres of its optics [m]."""
    return stereo_shape(sensor) if sensor["kind"] == "stereo" else structured_shape(sensor)


def scanner_shape() -> tuple[Shape, dict[str, NDArray]]:
    """Housing of the laser scanner about its camera, and where camera and slit of light are [m].

    The places of both are sketched: the workflow needs neither.
    """
    width, height, length = SCANNER_M
    places = {
        "camera": np.array([0.0, -0.32 * height, 0.0]),
        "laser slit": np.array([0.0, 0.30 * height, 0.0]),
    }
    body = box((width, height, length), (0, 0, -length / 2), "#D7D9DB")
    lens = _lens(places["camera"], 0.045, 0.012)
    slit = box((0.11, 0.03, 0.004), places["laser slit"], LENS)
    return joined([body, lens, slit]), places


def _housing(size: tuple, places: Mapping[str, NDArray], colour: str) -> Shape:
    middle = np.mean([min(p[0] for p in places.values()), max(p[0] for p in places.values())])
    front = -0.004
    body = box(size, (middle, 0.0, front - size[2] / 2), colour)
    return joined([body, *(_lens(place, 0.3 * size[1], 0.008) for place in places.values())])


def _lens(place: NDArray, radius: float, length: float) -> Shape:
    """Barrel and glass, looking along z."""
    barrel = cylinder(-length, 0.0, radius, LENS)
    glass = cylinder(0.0, 0.0006, 0.6 * radius, GLASS)
    shape = joined([barrel, glass])
    return Shape(shape.vertices_m + place, shape.faces, shape.colours)


def _own(count: int) -> NDArray:
    return np.arange(3 * count).reshape(-1, 3)


def _painted(vertices: NDArray, faces: NDArray, colour: str) -> Shape:
    return Shape(
        np.asarray(vertices), np.asarray(faces), np.tile(to_rgb(colour), (len(vertices), 1))
    )
