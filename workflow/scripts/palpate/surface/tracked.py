"""What a tracker is given of a capture, and what it gives: the template in every frame."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.config.model import Model
from palpate.npz import read_npz, write_npz
from palpate.solid.mesh import SolidMesh
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment
from palpate.surface.template import Template


@dataclass(frozen=True)
class Recorded:
    """What one capture gives to a tracker.

    Attributes
    ----------
    template : Template
        Undeformed, object frame.
    solid : SolidMesh
        The object's solid mesh, object frame.
    support : Support
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        One for each frame, camera frame.
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].
    forces_n : (f, 3) array
        Force on the object in each frame, camera frame [N].
    indenter_radius_m : float
    alignment : Alignment
        Of the template with the first frame.
    """

    template: Template
    solid: SolidMesh
    support: Support
    clouds: Sequence[tuple[NDArray, NDArray]]
    tips_m: NDArray
    forces_n: NDArray
    indenter_radius_m: float
    alignment: Alignment


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
    write_npz(path, vars(tracked))


def load_tracked(path: str | Path) -> Tracked:
    """Read tracked.npz; files without a prior have none.

    Raises
    ------
    ValueError
        If the file is damaged or lacks an array, or vertices are of another number than the rest's.
    """
    arrays = read_npz(path)
    missing = [one for one in Tracked.__dataclass_fields__ if one not in {*arrays, "prior"}]
    if missing:
        raise ValueError(f"{path}: {missing[0]}: expected an array, found none")
    moved, rest = arrays["vertices_m"].shape, arrays["rest_m"].shape
    if len(moved) != 3 or moved[1:] != rest or arrays["contact_frame"].shape:
        raise ValueError(f"{path}: vertices_m: expected frames of shape {rest}, found {moved}")
    plain = {"contact_frame": int(arrays["contact_frame"]), "prior": str(arrays.get("prior", ""))}
    return Tracked(**arrays | plain)


def describe(tracked: Tracked, *, tracker: str, options: Model) -> dict:
    """Say how a surface was tracked; content of tracked-<tracker>.json.

    Parameters
    ----------
    tracked : Tracked
    tracker : str
        Its name in config.yaml.
    options : Model
        The tracker's, with its ``kind``.

    Returns
    -------
    dict
        ``tracker``, ``kind``, ``options``, ``frames``, ``vertices``, ``contact_frame``, for each
        frame ``residual_rms_m`` (None where nothing was observed) and ``observed_vertices``, and
        ``prior`` (None where the tracker has none).
    """
    residual = [float(value) if np.isfinite(value) else None for value in tracked.residual_m]
    return {
        "tracker": tracker,
        "kind": options.kind,
        "options": options.written(),
        "frames": len(tracked.vertices_m),
        "vertices": len(tracked.template_m),
        "contact_frame": tracked.contact_frame,
        "residual_rms_m": residual,
        "observed_vertices": tracked.observed.sum(axis=1).tolist(),
        "prior": json.loads(tracked.prior) if tracked.prior else None,
    }
