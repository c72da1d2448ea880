"""What a tracker works on and what it gives: a frame's data, and the template in every frame."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Frame:
    """What a frame is tracked against, camera frame.

    Attributes
    ----------
    points_m, normals : (n, 3) arrays
        Captured points and added ones [m].
    captured : int
        The first so many points were captured.
    """

    points_m: NDArray
    normals: NDArray
    captured: int


@dataclass(frozen=True)
class Tracked:
    """The template in every frame; fields of tracked.npz.

    Attributes
    ----------
    template_m : (n, 3) array
        Undeformed vertices, object frame [m].
    faces : (m, 3) int array
    rest_m : (n, 3) array
        The same in the camera frame, rigidly aligned [m].
    vertices_m : (f, n, 3) array
        Vertices in each frame, camera frame [m].
    observed : (f, n) bool array
        Vertices whose position rests on captured points.
    camera_from_object : (4, 4) array
    residual_m : (f,) array
        Root mean square distance of observed vertices to their data, of the kind that the data
        term measures [m].
    contact_point_m : (3,) array
        Point of the undeformed surface that was touched, object frame [m].
    contact_frame : int
        First frame in contact.
    prior : str
        What the tracker took for granted about the material, as JSON; empty for nothing.
    """

    template_m: NDArray
    faces: NDArray
    rest_m: NDArray
    vertices_m: NDArray
    observed: NDArray
    camera_from_object: NDArray
    residual_m: NDArray
    contact_point_m: NDArray
    contact_frame: int
    prior: str = ""


def save_tracked(path: str | Path, tracked: Tracked) -> None:
    """Write tracked.npz."""
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **vars(tracked))


def load_tracked(path: str | Path) -> Tracked:
    """Read tracked.npz; files without a prior have none."""
    with np.load(path, allow_pickle=False) as data:
        arrays = {name: data[name] for name in data.files}
    plain = {"contact_frame": int(arrays["contact_frame"]), "prior": str(arrays.get("prior", ""))}
    return Tracked(**arrays | plain)
