"""A capture tracked: by the study's tracker with its added points (Sections 5.2.1 and 5.2.2)."""

import numpy as np
from numpy.typing import NDArray
from palpate.open3d_core import ClosestPoints
from palpate.surface.elastic_capture import track_by_elasticity
from palpate.surface.options import ElasticTracking
from palpate.surface.pose import to_camera
from palpate.surface.template import Template, refine_template, vertex_normals
from palpate.surface.tracked import Recorded, Tracked
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from thesis.tracker.completion import Completion
from thesis.tracker.data_points import Frame
from thesis.tracker.options import StudyTracking
from thesis.tracker.track import track_frames

# In Hertz's contact the sphere touches below half of its indentation.
TOUCHING_PART = 0.5
# Noise of the tip, some tenths of a millimetre, would turn the direction of a shorter press.
SHORT_PRESS_M = 0.002


def _by_study(recorded: Recorded, options: StudyTracking) -> Tracked:
    """By the study's tracker; who rests on a turned copy or an added point is not observed."""
    pose, contact = recorded.alignment.camera_from_object, recorded.alignment.contact_point_m
    fine, edge_m = recorded.template, options.refine_edge_m
    if edge_m is not None:
        fine = refine_template(fine, contact, radius_m=options.refine_radius_m, edge_m=edge_m)
    rest = to_camera(pose, fine.vertices_m)
    complete = Completion(recorded, rest, fine.faces) if options.completion == "fem" else None
    frames = AddedPoints(recorded, fine, rest, options).frames()
    vertices, observed, residual = track_frames(fine, rest, frames, options, complete=complete)
    return Tracked(
        template_m=fine.vertices_m,
        faces=fine.faces,
        rest_m=rest,
        vertices_m=vertices,
        observed=observed,
        camera_from_object=pose,
        residual_m=residual,
        contact_point_m=contact,
        contact_frame=recorded.alignment.contact_frame,
    )


TRACKERS = {"study": _by_study, "elastic": track_by_elasticity}


def track_capture(recorded: Recorded, options: StudyTracking | ElasticTracking) -> Tracked:
    """Track the aligned template through all frames, by the tracker of the options' kind.

    The study's (Section 4.3) with its added points (Section 5.2), or the elastic one.

    Parameters
    ----------
    recorded : Recorded
    options : StudyTracking or ElasticTracking

    Returns
    -------
    Tracked

    Raises
    ------
    ValueError
        If a frame has no points near the template.
    """
    return TRACKERS[options.kind](recorded, options)


class AddedPoints:
    """Clouds of a capture with the points that the options ask for.

    Parameters
    ----------
    recorded : Recorded
    fine : Template
        Object frame.
    rest_m : (n, 3) array
        Its vertices in the camera frame [m].
    options : StudyTracking
    """

    def __init__(
        self, recorded: Recorded, fine: Template, rest_m: NDArray, options: StudyTracking
    ) -> None:
        self.recorded, self.rest_m = recorded, rest_m
        self.part, self.copies = options.indenter_points, options.copies
        self.normals = vertex_normals(rest_m, fine.faces)
        pose, contact = recorded.alignment.camera_from_object, recorded.alignment.contact_point_m
        contact = to_camera(pose, contact)
        surface = ClosestPoints(rest_m, fine.faces)
        self.depths_m = recorded.indenter_radius_m - surface.signed_distance(recorded.tips_m)
        normal = surface.interpolate(self.normals, *surface(contact[None])[1:])[0]
        self.up = self._against_the_press(normal)
        self.still = self._still(fine, contact, options)

    def frames(self) -> list[Frame]:
        """Every frame's points: captured, turned, of the indenter, places of vertices."""
        recorded = self.recorded
        captured = zip(recorded.clouds, recorded.tips_m, self.depths_m, strict=True)
        return [self._frame(cloud, tip, float(depth)) for cloud, tip, depth in captured]

    def _frame(self, cloud: tuple[NDArray, NDArray], tip: NDArray, depth_m: float) -> Frame:
        owners = self.still
        places = self.rest_m[owners], self.normals[owners]
        parts = [cloud, self._turned(cloud), places]
        if self.part == "places":
            pressed, *pressed_points = pressed_places(
                self.rest_m,
                tip,
                self.up,
                radius_m=self.recorded.indenter_radius_m,
                depth_m=depth_m,
            )
            owners, parts = np.append(owners, pressed), [*parts, pressed_points]
        points, normals = (np.concatenate(part) for part in zip(*parts, strict=True))
        return Frame(points, normals, len(cloud[0]), owners)

    def _against_the_press(self, normal: NDArray) -> NDArray:
        """Direction from the deepest tip to the first in contact, or the surface's normal there."""
        tips = self.recorded.tips_m
        way = tips[self.recorded.alignment.contact_frame] - tips[np.argmax(self.depths_m)]
        length = np.linalg.norm(way)
        return way / length if length > SHORT_PRESS_M else normal / np.linalg.norm(normal)

    def _turned(self, cloud: tuple[NDArray, NDArray]) -> tuple[NDArray, NDArray]:
        """Copies about the normal of the support, through the middle of the object."""
        # A body of revolution has its centroid above the middle of its support, and it is known
        # better than that of a few vertices of the support.
        recorded = self.recorded
        pose = recorded.alignment.camera_from_object
        axis = pose[:3, :3] @ recorded.support.up
        centre = to_camera(pose, _centroid(recorded.template))
        return turned_copies(*cloud, centre_m=centre, axis=axis, copies=self.copies)

    def _still(self, fine: Template, contact_m: NDArray, options: StudyTracking) -> NDArray:
        """Vertices that stay: unseen ones far from the contact, those of the support."""
        still = np.zeros(0, dtype=int)
        if options.undeformed_points:
            reach = 2 * options.refine_radius_m
            cloud = self.recorded.clouds[0][0]
            still = undeformed_points(self.rest_m, cloud, contact_m, reach_m=reach)
        if self.copies > 1:
            held = np.flatnonzero(self.recorded.support.holds(fine.vertices_m))
            still = np.union1d(still, held)
        return still


def pressed_places(
    vertices_m: NDArray, tip_m: NDArray, up: NDArray, *, radius_m: float, depth_m: float
) -> tuple[NDArray, NDArray, NDArray]:
    """Places on the sphere of the vertices that it pushes straight down.

    The study adds a hemisphere's points, which leave vertices free to slide. Where a sphere presses
    a soft surface this hardly moves sideways: these places hold vertices in all directions.

    Parameters
    ----------
    vertices_m : (n, 3) array
        Undeformed template [m].
    tip_m : (3,) array
        Centre of the sphere [m].
    up : (3,) array
        Unit normal of the undeformed surface at the contact.
    radius_m, depth_m : float
        Radius of the sphere and depth of its lowest point below the undeformed surface [m].

    Returns
    -------
    vertices : (k,) int array
        Those that Hertz's contact touches; none before contact.
    points_m, normals : (k, 3) arrays
    """
    offset = vertices_m - tip_m
    height = offset @ up
    aside = ((offset - height[:, None] * up) ** 2).sum(axis=1)
    under = height + np.sqrt(np.maximum(radius_m**2 - aside, 0))
    touched = (aside < radius_m**2) & (np.abs(height) < 2 * radius_m)
    touched &= (under > TOUCHING_PART * depth_m) & (depth_m > 0)
    chosen = np.flatnonzero(touched)
    points = vertices_m[chosen] - under[chosen, None] * up
    return chosen, points, (tip_m - points) / radius_m


def undeformed_points(
    vertices_m: NDArray, cloud_m: NDArray, contact_m: NDArray, *, reach_m: float
) -> NDArray:
    """Template vertices that no camera sees and that lie far from the contact.

    Parameters
    ----------
    vertices_m : (n, 3) array
        The rigidly aligned template [m], camera frame.
    cloud_m : (k, 3) array
        First frame's cloud [m].
    contact_m : (3,) array
        Contact point [m].
    reach_m : float
        Vertices nearer than this to the contact or to the cloud are left out [m]; for the cloud
        a quarter of it counts.

    Returns
    -------
    (k,) int array
    """
    far = np.linalg.norm(vertices_m - contact_m, axis=1) > reach_m
    unseen = cKDTree(cloud_m).query(vertices_m)[0] > reach_m / 4
    return np.flatnonzero(far & unseen)


def turned_copies(
    points_m: NDArray, normals: NDArray, *, centre_m: NDArray, axis: NDArray, copies: int
) -> tuple[NDArray, NDArray]:
    """The cloud's further copies about an axis, as by the study's hexagon (Section 5.2.2).

    Parameters
    ----------
    points_m, normals : (n, 3) arrays
        The cloud [m].
    centre_m, axis : (3,) arrays
        Point of the axis [m] and its direction, of any length.
    copies : int
        How many there are with the cloud itself, evenly spread over the full turn.

    Returns
    -------
    points_m, normals : ((copies - 1) n, 3) arrays

    Raises
    ------
    ValueError
        If there is no copy.
    """
    if copies < 1:
        raise ValueError(f"copies: expected at least 1, found {copies}")
    unit = np.asarray(axis) / np.linalg.norm(axis)
    turns = [Rotation.from_rotvec(2 * np.pi * k / copies * unit) for k in range(1, copies)]
    none = [np.zeros((0, 3))]
    points = [centre_m + turn.apply(points_m - centre_m) for turn in turns]
    return np.concatenate(points + none), np.concatenate(
        [turn.apply(normals) for turn in turns] + none
    )


def _centroid(template: Template) -> NDArray:
    """Centroid of the volume, shape (3,) [m]."""
    corners = template.vertices_m[template.faces]
    volumes = np.linalg.det(corners)
    return (volumes[:, None] * corners.sum(axis=1)).sum(axis=0) / (4 * volumes.sum())
