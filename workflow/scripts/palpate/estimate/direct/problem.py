"""From a capture's surface displacement, poses and forces to what the direct estimate compares."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import EllipsisType

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.tables import columns_of
from palpate.config.sensor import said_of_base
from palpate.estimate.direct.contact import Contact, depth_along, object_from_table
from palpate.estimate.direct.indentation import DirectIndentation, SupportAxes, zero_std
from palpate.estimate.direct.motion import SurfaceMotion
from palpate.estimate.direct.options import (
    BASE_SOURCE,
    TIP_PART,
    TIP_SOURCE,
    UNSTATED,
    Fit,
    ProbeUncertainty,
)
from palpate.estimate.direct.table import axes_across, sample_table
from palpate.estimate.hertz.indentation import noise_of
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.load import hertz_contact_radius
from palpate.solid.smooth_surface import SmoothSurface
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from palpate.surface.sharp_edges import sharp_edge_distance
from palpate.vision.clock import stated_clock_std_s
from palpate.vision.force import FORCE
from palpate.vision.probe import ALONG_STD, TIP, from_pictures, marker_transforms

# A force sensor's noise is not less [N].
LEAST_NOISE_N = 1e-4
# Samples up to here are compared on any base: nearer to the contact windows hold the probe too [m].
LEAST_REACH_M = 0.03


@dataclass(frozen=True)
class ProbeRecord:
    """What pose and force files say of one capture.

    Attributes
    ----------
    time_s : (f,) array
        Of the frames, and of poses between them [s].
    tips_m, forces_n : (f, 3) arrays
        Centre of the sphere [m] and force on the object [N], camera frame.
    tip_std_m : float
        Deviation of a tip along the probe's axis [m].
    stiffness_n_m : float
        Of the probe between target and tip along its axis; infinite where its file says nothing.
    clock_offset_s, clock_std_s : float
        Force clock minus the poses', which of pictures is the camera's, as the forces take it; and
        the deviation of the force's from the camera's before an indentation determines it [s].
    turns : (f, 3, 3) array
        Of the probe's target or tracked frame, camera frame.
    uncertainty : ProbeUncertainty, optional
        Of the probe's file; with a base where poses come from elsewhere than the pictures.
    camera_clock_std_s : float, optional
        Deviation of their clock from the camera's [s].
    pictured : (g,) int array, optional
        Which of the times are those of the camera's frames.
    """

    time_s: NDArray
    tips_m: NDArray
    forces_n: NDArray
    tip_std_m: float
    stiffness_n_m: float
    clock_offset_s: float
    clock_std_s: float
    turns: NDArray
    uncertainty: ProbeUncertainty = UNSTATED
    camera_clock_std_s: float = 0.0
    pictured: NDArray | EllipsisType = ...

    @staticmethod
    def of(
        path: pd.DataFrame, probe: Mapping, sensor: Mapping, *, clock_offset_s: float
    ) -> "ProbeRecord":
        """What path.csv and clock.json say, with the probe's file and the sensor's."""
        base = None if from_pictures(path) else sensor["base"]
        return ProbeRecord(
            time_s=path["time_s"].to_numpy(float),
            tips_m=columns_of(path, TIP),
            forces_n=columns_of(path, FORCE),
            tip_std_m=float(np.nanmedian(path[ALONG_STD])),
            stiffness_n_m=probe.get("stiffness_n_m", np.inf),
            clock_offset_s=clock_offset_s,
            clock_std_s=stated_clock_std_s(sensor),
            turns=marker_transforms(path)[:, :3, :3],
            uncertainty=ProbeUncertainty.of(probe, base),
            camera_clock_std_s=said_of_base(sensor, "clock_offset_std_s") if base else 0.0,
            pictured=np.flatnonzero(path["frame"].notna()),
        )

    def shared_roots_m(self, row: int, place_std_m: float) -> dict[str, NDArray]:
        """Errors of the tip at a time that captures share, camera frame, (3, e) [m] by source."""
        known = self.uncertainty
        roots = {TIP_SOURCE: self.turns[row] @ known.tip_root_m(place_std_m)}
        if known.base is not None:
            roots[BASE_SOURCE] = known.base_root_m(self.tips_m[row])
        return roots


def direct_indentation(
    record: ProbeRecord,
    motion: SurfaceMotion,
    alignment: Alignment,
    template: SmoothSurface,
    table: IndentationModel,
    support: Support,
    options: Fit,
) -> DirectIndentation:
    """Collect what the direct estimate compares of one capture.

    The template is the undeformed surface in the object frame, the table that of the indented
    point.

    Raises
    ------
    ValueError
        If the tip never touches, force and depth contradict each other, or no frame or sample is
        left.
    """
    _check_belonging(record, motion)
    pose, radius_m = alignment.camera_from_object, table.radius_m
    tips, forces = to_object(pose, record.tips_m), record.forces_n @ pose[:3, :3]

    def contact_along(direction: NDArray) -> Contact:
        """Depth and force along a unit vector."""
        force = forces @ direction
        depth = depth_along(template, tips, direction, radius_m=radius_m)
        # The target goes down farther than the tip by the probe's compliance.
        return Contact.of(depth - force / record.stiffness_n_m, force, options)

    declared = contact_along(table.direction)
    offset_std_m = float(np.hypot(record.tip_std_m, options.offset_std_m))
    across = axes_across(table.direction)
    turn = np.stack([table.direction, *across]) @ pose[:3, :3].T
    at_peak = record.shared_roots_m(int(np.argmax(declared.force_n)), options.place_std_m)
    roots = {name: turn @ root for name, root in at_peak.items()}
    declared.check(zero_std_m=zero_std(offset_std_m, roots))
    touch = declared.first_touch(tips, table.direction)
    place = object_from_table(table, template, touch)
    beside_m = to_object(place, touch[None])[0] - (table.point_m - radius_m * table.direction)
    # A table that turned with the surface is of an indentation that turned too.
    direction = place[:3, :3] @ table.direction
    contact = contact_along(direction)
    loaded = contact.loaded_frames(tip_std_m=record.tip_std_m)
    frames = loaded[contact.pressed_m[loaded] <= table.depth_m[-1]]
    if not len(frames):
        raise ValueError(
            "table: expected frames in contact within its"
            f" {table.depth_m[-1] * 1e3:.1f} mm, found none (indenter.radius_m, template"
            " or transforms of the probe wrong, or a deeper table wanted?)"
        )
    middle = tips[frames].mean(axis=0)
    sharp_edges = sharp_edge_distance(template.vertices_m, template.faces, motion.cell_m)
    deepest_m = max(contact.pressed_m[frames].max(), 1e-6)
    nearest_m, farthest_m = compared_m(table, support, options, radius_m, deepest_m)
    # Far enough beside the contact, and near enough to move.
    away = motion.cell_m - middle
    beside = np.linalg.norm(away - (away @ direction)[:, None] * direction, axis=1)
    chosen = (beside > nearest_m) & (np.linalg.norm(away, axis=1) < farthest_m)
    chosen &= sharp_edges > options.crease_m
    if not chosen.any():
        raise ValueError(
            f"samples: expected some from {nearest_m * 1e3:.0f} to {farthest_m * 1e3:.0f} mm from"
            " the contact, found none"
        )
    cell, normal = motion.cell_m[chosen], motion.normal[chosen]
    pictured = np.arange(len(tips))[record.pictured]
    seen = np.full((2, len(tips), len(cell)), np.nan)
    seen[:, pictured] = motion.moved_m[:, chosen], motion.noise_std_m[:, chosen]
    moved, noise = seen[:, frames]
    if not np.isfinite(moved).any():
        raise ValueError(
            "samples: expected some that are seen while the tip presses, found all hidden"
        )
    way = np.diff(tips[[contact.onset - 1, np.argmax(contact.depth_m)]], axis=0)[0]
    given = {"support": support, "contact_m": middle, "direction": direction, "options": options}
    return DirectIndentation(
        time_s=record.time_s,
        tip_std_m=record.tip_std_m,
        clock_std_s=record.clock_std_s,
        camera_clock_std_s=record.camera_clock_std_s,
        pictured=record.pictured,
        force_n=contact.force_n,
        tip_depth_m=contact.depth_m,
        frames=frames,
        frames_beyond=int(np.isin(np.setdiff1d(loaded, frames), pictured).sum()),
        oblique_rad=float(np.arctan2(np.linalg.norm(np.cross(way, direction)), way @ direction)),
        depth_m=contact.depth_m[frames],
        depth_root_m=record.tip_std_m * np.eye(len(frames)),
        offset_std_m=offset_std_m,
        clock_expected_s=record.clock_offset_s,
        force_std_n=max(noise_of(contact.force_n[: max(contact.onset - 1, 2)]), LEAST_NOISE_N),
        place_expected_m=across @ beside_m,
        place_std_m=np.sqrt(1 - TIP_PART) * options.place_std_m,
        contact_m=middle,
        cell_m=cell,
        moved_m=moved,
        noise_std_m=noise,
        moved_std_m=noise,
        # One part until residuals show how far errors are alike (`with_pattern`).
        cluster=np.zeros(len(cell), dtype=int),
        support_axes=SupportAxes.of(cell, normal, **given),
        table=sample_table(table, to_object(place, cell), normal @ place[:3, :3]),
        shared_roots_m=roots,
    )


def compared_m(
    table: IndentationModel, support: Support, options: Fit, radius_m: float, depth_m: float
) -> tuple[float, float]:
    """From where to where samples are compared, distances from a sphere of this depth [m].

    A broad base that is not bonded sticks below the contact and slides far from it, as neither of
    the table's does: beyond about the height of the contact it moves the surface as nu would.
    """
    contact_m = hertz_contact_radius(indenter_radius_m=radius_m, depth_m=depth_m)
    nearest_m = options.nearest_m + options.nearest_radii * contact_m
    if not table.slides:
        return nearest_m, options.farthest_m
    height_m = float(support.heights_m(table.point_m[None])[0])
    least_m = float(np.hypot(max(2 * nearest_m, LEAST_REACH_M), radius_m))
    return nearest_m, min(options.farthest_m, max(height_m, least_m))


def _check_belonging(record: ProbeRecord, motion: SurfaceMotion) -> None:
    """Reject poses, forces and displacements of different recordings."""
    between = len(record.time_s) - len(record.time_s[record.pictured])
    rows = len(record.time_s), len(record.forces_n), len(motion.moved_m) + between
    counts = {count - between for count in rows}
    if len(counts) > 1:
        raise ValueError(
            f"frames: expected as many in poses, forces and motion, found {sorted(counts)}"
        )
    if not (np.isfinite(record.tips_m).all() and np.isfinite(record.forces_n).all()):
        raise ValueError("tip: expected numbers in all frames, found NaN or infinity")
    if not record.tip_std_m > 0:
        raise ValueError(f"tip: expected a deviation above 0 m, found {record.tip_std_m}")
