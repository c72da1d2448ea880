"""What the figures of tracked surfaces read: captures as trackers get them, and surfaces."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate.capture.images import Stream
from palpate.capture.tables import read_table
from palpate.json_fields import read_all
from palpate.report.panels import Surface
from palpate.solid.mesh import read_solid
from palpate.surface.alignment import load_alignment
from palpate.surface.pose import to_camera, to_object
from palpate.surface.template import Template, read_template
from palpate.surface.tracked import Recorded, load_tracked
from palpate.vision.camera import camera_from_spec, with_calibration
from palpate.vision.clouds import read_clouds
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP
from palpate.workflow.object_inputs import read_declared

from thesis.tracker.capture import AddedPoints
from thesis.tracker.options import StudyTracking

PICTURE_MARGIN = 0.12


def recordings_of(inputs: Any, probes: Sequence[Mapping]) -> list[Recorded]:
    """Every capture of a rule, as its tracker got it."""
    names = ("object", "template", "solid", "clouds", "pose", "force", "alignment")
    columns = (getattr(inputs, name) for name in names)
    return [_recorded(*files) for files in zip(*columns, probes, strict=True)]


def last_frames(inputs: Any) -> list[int]:
    """The most pressed frame of each capture's Hertz fit."""
    return [fit["range"]["last_frame"] for fit in read_all(inputs.fits)]


def surface_of(path: str, frame: int) -> Surface:
    """A tracked surface in a frame."""
    tracked = load_tracked(path)
    deformed = to_object(tracked.camera_from_object, tracked.vertices_m[frame])
    return Surface(tracked.template_m, deformed, tracked.faces, tracked.contact_point_m)


def photos_of(
    inputs: Any, sensors: Sequence[Mapping], recordings: Sequence[Recorded], frames: list[int]
) -> list[NDArray]:
    """The reference cameras' pictures of the frames, cut to the object and the tip."""
    optics = iter(read_all(inputs.optics))
    known = [with_calibration(s, next(optics)) if _calibrated(s) else s for s in sensors]
    parts = zip(inputs.recorded, known, recordings, frames, strict=True)
    return [_photo(*part) for part in parts]


def added_points(
    recorded: Recorded, path: str, options: StudyTracking, frame: int
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Captured points of a frame, turned copies, places that stay, and the indenter's.

    All are (n, 3) arrays in the object frame [m], as the tracker of these options had them.
    """
    tracked = load_tracked(path)
    fine = Template(tracked.template_m, tracked.faces)
    added = AddedPoints(recorded, fine, tracked.rest_m, options)
    points = to_object(tracked.camera_from_object, added.frames()[frame].points_m)
    own, still = len(recorded.clouds[frame][0]), len(added.still)
    turned, held = own * added.copies, own * added.copies + still
    return points[:own], points[own:turned], points[turned:held], points[held:]


def _calibrated(sensor: Mapping) -> bool:
    return sensor.get("optics") == "calibration"


def _photo(folder: str, sensor: Mapping, recorded: Recorded, frame: int) -> NDArray:
    camera = camera_from_spec(sensor["color"])
    placed = to_camera(recorded.alignment.camera_from_object, recorded.template.vertices_m)
    pixels = camera.project(np.vstack([placed, recorded.tips_m[frame]]))
    margin = PICTURE_MARGIN * np.ptp(pixels, axis=0).max()
    size = [camera.width_px, camera.height_px]
    low = np.clip(pixels.min(axis=0) - margin, 0, size).astype(int)
    high = np.clip(pixels.max(axis=0) + margin, 0, size).astype(int)
    return Stream(folder, sensor)[frame][low[1] : high[1], low[0] : high[0]]


def _recorded(spec, template, solid, clouds, pose, force, alignment, probe) -> Recorded:
    declared, support = read_declared(spec)
    return Recorded(
        read_template(template, unit=declared["template"]["unit"]),
        read_solid(solid),
        support,
        read_clouds(clouds),
        read_table(pose)[TIP].to_numpy(float),
        read_table(force)[FORCE].to_numpy(float),
        probe["indenter"]["radius_m"],
        load_alignment(alignment),
    )
