"""Figures 5.5, 5.7, 5.11, 5.13 and 5.16 from what trackers get and what they make of it."""

from typing import Any

from matplotlib.figure import Figure
from palpate.report.views import view_from
from palpate.surface.alignment import load_alignment
from palpate.surface.pose import to_object
from palpate.surface.tracked import Recorded

from thesis.chapter5 import tracking_figures as figures
from thesis.chapter5.tracking_inputs import (
    added_points,
    last_frames,
    photos_of,
    recordings_of,
    surface_of,
)
from thesis.tracker.options import StudyTracking, tracking_options

# Of the views of the ball, above the camera's side.
CLOUDS_DEG, SURFACES_DEG = 25, 10


def make_figure_5_5(inputs: Any, params: Any) -> Figure:
    """The block's picture, cloud with added points and tracked surface, by sensor."""
    recordings, frames = recordings_of(inputs, params.probes), last_frames(inputs)
    surfaces = [surface_of(*pair) for pair in zip(inputs.tracked, frames, strict=True)]
    files = zip(
        recordings, inputs.tracked, map(tracking_options, params.options), frames, strict=True
    )
    clouds = [_added_cloud(*each) for each in files]
    photos = photos_of(inputs, params.sensors, recordings, frames)
    return figures.figure_5_5(params.captures, photos, clouds, surfaces)


def make_figure_5_7(inputs: Any, params: Any) -> Figure:
    """The dent tracked without and with refined triangles at the contact."""
    recorded, frame = recordings_of(inputs, params.probes)[0], last_frames(inputs)[0]
    pair = [surface_of(path, frame) for path in (inputs.unrefined[0], inputs.tracked[0])]
    cloud = to_object(recorded.alignment.camera_from_object, recorded.clouds[frame][0])
    return figures.figure_5_7(params.captures[0], *pair, cloud)


def make_figure_5_11(inputs: Any, params: Any) -> Figure:
    """The ball's cloud, and the cloud turned about the support's normal, by sensor."""
    recordings, frames = recordings_of(inputs, params.probes), last_frames(inputs)
    poses = [recorded.alignment.camera_from_object for recorded in recordings]
    views = [view_from(pose, elevation_deg=CLOUDS_DEG) for pose in poses]
    files = zip(
        recordings, inputs.tracked, map(tracking_options, params.options), frames, strict=True
    )
    return figures.figure_5_11(params.captures, views, [_turned(*each) for each in files])


def make_figure_5_13(inputs: Any, params: Any) -> Figure:
    """The ball tracked from one view and from turned clouds, by sensor."""
    poses = [load_alignment(path).camera_from_object for path in inputs.alignment]
    views = [view_from(pose, elevation_deg=SURFACES_DEG) for pose in poses]
    files = zip(inputs.single_view, inputs.tracked, last_frames(inputs), strict=True)
    pairs = [(surface_of(one, k), surface_of(turned, k)) for one, turned, k in files]
    return figures.figure_5_13(params.captures, views, pairs)


def make_figure_5_16(inputs: Any, params: Any) -> Figure:
    """The ear's picture, cloud and tracked surface, by the first sensor that recorded it."""
    recordings, frames = recordings_of(inputs, params.probes), last_frames(inputs)
    pose, frame = recordings[0].alignment.camera_from_object, frames[0]
    photo = photos_of(inputs, params.sensors, recordings, frames)[0]
    cloud = to_object(pose, recordings[0].clouds[frame][0])
    surface = surface_of(inputs.tracked[0], frame)
    return figures.figure_5_16(params.captures[0], photo, view_from(pose), cloud, surface)


def _added_cloud(
    recorded: Recorded, path: str, options: StudyTracking, frame: int
) -> figures.AddedCloud:
    captured, _, still, pressed = added_points(recorded, path, options, frame)
    return figures.AddedCloud(captured, still, pressed)


def _turned(
    recorded: Recorded, path: str, options: StudyTracking, frame: int
) -> figures.TurnedClouds:
    rest, pressed = (added_points(recorded, path, options, k)[:3] for k in (0, frame))
    return figures.TurnedClouds(pressed[0], rest, pressed)
