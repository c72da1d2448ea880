"""Track one capture as the study does: refined template, added points, every frame."""

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import ClosestPoints
from palpate.surface.augment import (
    indenter_points,
    pressed_places,
    turned_copies,
    undeformed_points,
)
from palpate.surface.completion import Completion
from palpate.surface.data_points import Frame
from palpate.surface.options import StudyTracking
from palpate.surface.pose import to_camera
from palpate.surface.recorded import Recorded
from palpate.surface.template import Template, refine_template, vertex_normals
from palpate.surface.track import track_frames
from palpate.surface.tracked import Tracked

# Noise of the tip, some tenths of a millimetre, would turn the direction of a shorter press.
SHORT_PRESS_M = 0.002


def track_by_study(recorded: Recorded, options: StudyTracking) -> Tracked:
    """Track with the study's tracker (Section 4.3) and its added points (Section 5.2).

    Parameters
    ----------
    recorded : Recorded
    options : StudyTracking

    Returns
    -------
    Tracked
        A vertex whose position rests on a turned copy or an added point is not observed.

    Raises
    ------
    ValueError
        If a frame has no points near the template.
    """
    pose, contact = recorded.alignment.camera_from_object, recorded.alignment.contact_point_m
    fine = _refined(recorded.template, contact, options)
    rest = to_camera(pose, fine.vertices_m)
    vertices, observed, residual = track_frames(
        fine,
        rest,
        AddedPoints(recorded, fine, rest, options).frames(),
        options,
        complete=_completion(recorded, rest, fine.faces, options),
    )
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
        sphere = {"radius_m": self.recorded.indenter_radius_m, "depth_m": depth_m}
        touched = indenter_points(tip, self.up, part=self.part, **sphere)
        owners = self.still
        places = self.rest_m[owners], self.normals[owners]
        parts = [cloud, self._turned(cloud), touched, places]
        if self.part == "places":
            pressed, *pressed_points = pressed_places(self.rest_m, tip, self.up, **sphere)
            owners, parts = np.append(owners, pressed), [*parts, pressed_points]
        points, normals = (np.concatenate(part) for part in zip(*parts, strict=True))
        return Frame(points, normals, len(cloud[0]), owners)

    def _against_the_press(self, normal: NDArray) -> NDArray:
        """Direction from the deepest tip back to the first in contact.

        Where the press is too short to have a direction, the surface's normal at the contact.
        """
        tips = self.recorded.tips_m
        way = tips[self.recorded.alignment.contact_frame] - tips[np.argmax(self.depths_m)]
        length = np.linalg.norm(way)
        return way / length if length > SHORT_PRESS_M else normal / np.linalg.norm(normal)

    def _turned(self, cloud: tuple[NDArray, NDArray]) -> tuple[NDArray, NDArray]:
        """Copies about the normal of the support, through the middle of the object.

        A body of revolution has its centroid above the middle of its support, and it is known
        better than that of a few vertices of the support.
        """
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


def _refined(template: Template, contact_m: NDArray, options: StudyTracking) -> Template:
    edge = options.refine_edge_m
    if edge is None:
        return template
    radius = options.refine_radius_m
    return refine_template(template, contact_m, radius_m=radius, edge_m=edge)


def _completion(
    recorded: Recorded, rest_m: NDArray, faces: NDArray, options: StudyTracking
) -> Completion | None:
    if options.completion == "none":
        return None
    return Completion(
        recorded.solid,
        recorded.support,
        recorded.alignment.camera_from_object,
        rest_m,
        faces,
        contact_m=recorded.alignment.contact_point_m,
        forces_n=recorded.forces_n,
        indenter_radius_m=recorded.indenter_radius_m,
    )


def _centroid(template: Template) -> NDArray:
    """Centroid of the volume, shape (3,) [m]."""
    corners = template.vertices_m[template.faces]
    volumes = np.linalg.det(corners)
    return (volumes[:, None] * corners.sum(axis=1)).sum(axis=0) / (4 * volumes.sum())
