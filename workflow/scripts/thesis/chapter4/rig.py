"""The rig from its configuration: solid parts, poses and fields of view."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import trimesh
from matplotlib.colors import to_rgba
from numpy.typing import NDArray
from palpate.vision.camera import camera_from_spec
from palpate.vision.probe import marker_transforms

STONE, STEEL, DARK_STEEL, RUBBER = "#A9A29A", "#C3C9CF", "#8E979F", "#4A4F55"
BODY, LENS, GLASS, GOLD, PALE = "#5A6068", "#22262B", "#7FA6C9", "#D9A441", "#D7D9DB"
WHITE, INK = "#F2F2F2", "#3A3A3A"
# What the files don't give, as drawn [m]; nothing is computed from it. The force sensor is of
# ATI's data sheet of the Nano25; housings have about the devices' width, height, length.
NANO25_RADIUS_M, NANO25_LENGTH_M = 0.0125, 0.0216
HANDLE_RADIUS_M, HANDLE_M, STEM_RADIUS_M = 0.011, 0.120, 0.0035
HOUSINGS = {"stereo": (0.157, 0.036, 0.0474), "structured_light": (0.282, 0.038, 0.063)}
OTHER_HOUSING = (0.09, 0.025, 0.025)
SCANNER_M = (0.213, 0.413, 0.271)
MARGIN_M, SHEET_M = 0.016, 0.003
# The probe stands upright on the object: the force frame's z points down.
UPRIGHT = np.diag([1.0, -1.0, -1.0, 1.0])


def box(size_m: Sequence[float], centre_m: Sequence[float], colour: str) -> trimesh.Trimesh:
    """Block with sides along the axes."""
    mesh = trimesh.creation.box(extents=size_m)
    return _painted(mesh.apply_translation(centre_m), colour)


def cylinder(start_m: float, stop_m: float, radius_m: float, colour: str) -> trimesh.Trimesh:
    """Cylinder about the z axis."""
    ends = [[0, 0, start_m], [0, 0, stop_m]]
    return _painted(trimesh.creation.cylinder(radius_m, segment=ends, sections=64), colour)


def probe_mesh(probe: Mapping) -> trimesh.Trimesh:
    """Sphere, stem, force sensor, handle and target of a probe, in the frame of its force sensor.

    Parameters
    ----------
    probe : mapping
        The probe's file. Handle and stem are sketched, the force sensor is ATI's Nano25.
    """
    centre = np.array(probe["force_from_tip"])[:3, 3]
    radius = probe["indenter"]["radius_m"]
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius).apply_translation(centre)
    ball.visual.vertex_colors = to_rgba(STONE)
    target = target_mesh(probe["marker"])
    parts = [
        ball,
        cylinder(NANO25_LENGTH_M, centre[2] - 0.6 * radius, STEM_RADIUS_M, STEEL),
        cylinder(0.0, NANO25_LENGTH_M, NANO25_RADIUS_M, DARK_STEEL),
        cylinder(-HANDLE_M, 0.0, HANDLE_RADIUS_M, RUBBER),
        target.apply_transform(np.linalg.inv(probe["marker_from_force"])),
    ]
    return trimesh.util.concatenate(parts)


def target_mesh(marker: Mapping) -> trimesh.Trimesh:
    """Checkerboard in its own frame: a sheet with the squares on the side that is seen (-z)."""
    squares = np.array(marker["inner_corners"]) + 1
    side = marker["square_m"]
    size = squares * side + 2 * MARGIN_M
    parts = [box([*size, SHEET_M], [*(squares / 2 - 1) * side, SHEET_M / 2], WHITE)]
    for column, row in np.ndindex(*squares):
        if (row + column) % 2 == 0:
            place = (np.array([column, row]) - 0.5) * side
            parts.append(box([side, side, 0.0002], [*place, -0.0002], INK))
    return trimesh.util.concatenate(parts)


def sensor_mesh(sensor: Mapping | None) -> tuple[trimesh.Trimesh, dict[str, NDArray]]:
    """Housing of a sensor and the centres of its optics by name [m].

    Parameters
    ----------
    sensor : mapping or None
        The sensor's file; None for the laser scanner, whose optics are sketched.

    Returns
    -------
    Trimesh, dict
        In the frame of its reference camera: the left one, or the colour camera.
    """
    if sensor is None:
        width, height, length = SCANNER_M
        places = {"camera": [0.0, -0.32 * height, 0.0], "laser slit": [0.0, 0.30 * height, 0.0]}
        body = box((width, height, length), (0, 0, -length / 2), PALE)
        slit = box((0.11, 0.03, 0.004), places["laser slit"], LENS)
        parts = [body, slit, *_lens(places["camera"], 0.045, 0.012)]
        return trimesh.util.concatenate(parts), {k: np.array(v) for k, v in places.items()}
    if sensor["kind"] == "stereo":
        ends = {"left camera": 0.0, "right camera": sensor["stereo"]["baseline_m"]}
        places, colour = {name: np.array([x, 0.0, 0.0]) for name, x in ends.items()}, GOLD
    else:
        spec, colour = sensor["depth"], BODY
        color_from_depth = np.array(spec["color_from_depth"])
        places = {
            "infrared camera": color_from_depth[:3, 3],
            "colour camera": np.zeros(3),
            "infrared projector": (color_from_depth @ [spec["baseline_m"], 0, 0, 1])[:3],
        }
    size = HOUSINGS.get(sensor["kind"], OTHER_HOUSING)
    across = [place[0] for place in places.values()]
    body = box(size, ((min(across) + max(across)) / 2, 0.0, -0.004 - size[2] / 2), colour)
    lenses = [part for place in places.values() for part in _lens(place, 0.3 * size[1], 0.008)]
    return trimesh.util.concatenate([body, *lenses]), places


def cameras(sensor: Mapping, pose: NDArray) -> dict[str, tuple[Mapping, NDArray]]:
    """Cameras of a sensor by name: optics and pose (4, 4), the reference camera's first."""
    if sensor["kind"] == "stereo":
        aside = np.eye(4)
        aside[0, 3] = sensor["stereo"]["baseline_m"]
        return {"left": (sensor["color"], pose), "right": (sensor["color"], pose @ aside)}
    depth = sensor["depth"]
    infrared = pose @ np.array(depth["color_from_depth"])
    return {"colour": (sensor["color"], pose), "infrared": (depth, infrared)}


def camera_pose(placement: Mapping) -> NDArray:
    """Pose of a level camera in front of the object that looks at its target, shape (4, 4).

    Axes are right, down and ahead; the camera stands on the side y < 0 of the object frame.
    """
    elevation = np.deg2rad(placement["elevation_deg"])
    ahead = np.array([0.0, np.cos(elevation), -np.sin(elevation)])
    right = np.array([1.0, 0.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(ahead, right), ahead])
    pose[:3, 3] = np.array(placement["target_m"]) - placement["distance_m"] * ahead
    return pose


def frustum(camera: Mapping, pose: NDArray, reach_m: float, *, table: bool = True) -> NDArray:
    """Centre of a camera and the corners of its field of view, shape (5, 3) [m].

    Each corner's ray ends at a depth of ``reach_m``, or where there is a table there, z = 0.
    """
    optics = camera_from_spec(dict(camera) | {"distortion": [0.0] * 5})
    width, height = optics.width_px, optics.height_px
    rays = optics.rays([[0, 0], [width, 0], [width, height], [0, height]]) @ pose[:3, :3].T
    height = pose[2, 3] if table else np.inf
    depth = np.minimum(height / np.maximum(-rays[:, 2], 1e-9), reach_m)
    return pose[:3, 3] + np.vstack([np.zeros(3), depth[:, None] * rays])


def field_deg(camera: Mapping) -> tuple[float, float]:
    """Horizontal and vertical field of view of a camera, both sides together [deg]."""
    found = []
    for size, focal, centre in (("width", "fx", "cx"), ("height", "fy", "cy")):
        ends = np.array([0, camera[f"{size}_px"]]) - camera[f"{centre}_px"]
        found.append(float(np.ptp(np.rad2deg(np.arctan(ends / camera[f"{focal}_px"])))))
    return found[0], found[1]


def probe_on(probe: Mapping, point_m: Sequence[float]) -> trimesh.Trimesh:
    """The probe whose sphere touches a point of the object from above."""
    place = UPRIGHT.copy()
    tip = np.array(point_m) + [0, 0, probe["indenter"]["radius_m"]]
    place[:3, 3] = tip - UPRIGHT[:3, :3] @ np.array(probe["force_from_tip"])[:3, 3]
    return probe_mesh(probe).apply_transform(place)


def tilt_deg(probe: Mapping) -> float:
    """Angle between the target's plane and the probe's axis [deg]."""
    normal = np.linalg.inv(probe["marker_from_force"])[:3, 2]
    return float(np.rad2deg(np.arcsin(abs(normal[2]))))


def chain(pose: pd.DataFrame, probe: Mapping) -> dict[str, NDArray]:
    """Frames of Eq. 4.20 in the camera's, in the first frame that shows the marker.

    Parameters
    ----------
    pose : DataFrame
        probe_pose.csv.
    probe : mapping
        The probe's file.

    Returns
    -------
    dict
        ``camera``, ``marker``, ``force`` and ``tip``, each a (4, 4) transform to the camera [m].

    Raises
    ------
    ValueError
        If the marker is in no frame.
    """
    seen = np.flatnonzero(pose["detected"] == 1)
    if not len(seen):
        raise ValueError(f"pose: expected a frame with the marker, found none of {len(pose)}")
    marker = marker_transforms(pose)[seen[0]]
    force = marker @ np.array(probe["marker_from_force"])
    tip = force @ np.array(probe["force_from_tip"])
    return {"camera": np.eye(4), "marker": marker, "force": force, "tip": tip}


def _lens(place: NDArray, radius: float, length: float) -> list[trimesh.Trimesh]:
    """Barrel and glass, looking along z."""
    parts = cylinder(-length, 0.0, radius, LENS), cylinder(0.0, 0.0006, 0.6 * radius, GLASS)
    return [part.apply_translation(place) for part in parts]


def _painted(mesh: trimesh.Trimesh, colour: str) -> trimesh.Trimesh:
    # Corners of its own for each face: edges stay sharp.
    mesh.unmerge_vertices()
    mesh.visual.vertex_colors = to_rgba(colour)
    return mesh
