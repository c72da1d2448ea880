"""From a capture's motion, poses and forces to what the direct estimate compares."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.tables import columns_of
from palpate.estimate.direct.contact import Contact, depth_along, loaded_frames, oblique
from palpate.estimate.direct.indentation import KINDS, DirectIndentation, patches_of
from palpate.estimate.direct.motion import MotionAlong, SurfaceMotion
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.placement import object_from_table
from palpate.estimate.direct.probe_uncertainty import (
    TIP_PART,
    UNSTATED,
    ProbeUncertainty,
    turned_gravity,
)
from palpate.estimate.direct.support_motion import rocking_axes, support_axes_of
from palpate.estimate.direct.table import sample_table
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.load import hertz_contact_radius
from palpate.solid.smooth_surface import SmoothSurface
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from palpate.surface.sharp_edges import sharp_edge_distance
from palpate.units import FROM_MEDIAN
from palpate.vision.probe import ALONG_STD, TIP, marker_transforms


@dataclass(frozen=True)
class ProbeRecord:
    """What pose and force files say of one capture.

    Attributes
    ----------
    time_s : (f,) array
        Of the frames [s].
    tips_m : (f, 3) array
        Centre of the sphere, camera frame [m].
    forces_n : (f, 3) array
        On the object, camera frame [N].
    tip_std_m : float
        Deviation of a tip along the probe's axis [m].
    stiffness_n_m : float
        Of the probe between board and tip along its axis; infinite where its file says nothing
        [N/m].
    clock_offset_s, clock_std_s : float
        Force clock minus camera clock as the forces take it, and its deviation from 0 before a
        press tells more [s].
    turns : (f, 3, 3) array
        Of the probe's board, camera frame.
    uncertainty : ProbeUncertainty, optional
        Of the probe's file.
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

    @staticmethod
    def of(
        poses: pd.DataFrame,
        forces_n: NDArray,
        probe: Mapping,
        *,
        clock_offset_s: float,
        clock_std_s: float,
    ) -> "ProbeRecord":
        """What probe_pose.csv, forces (f, 3) [N] and clock.json say, of a probe's file."""
        return ProbeRecord(
            time_s=poses["time_s"].to_numpy(float),
            tips_m=columns_of(poses, TIP),
            forces_n=forces_n,
            tip_std_m=float(np.nanmedian(poses[ALONG_STD])),
            stiffness_n_m=probe.get("stiffness_n_m", np.inf),
            clock_offset_s=clock_offset_s,
            clock_std_s=clock_std_s,
            turns=marker_transforms(poses)[:, :3, :3],
            uncertainty=ProbeUncertainty.of(probe),
        )


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

    Parameters
    ----------
    record : ProbeRecord
    motion : SurfaceMotion
    alignment : Alignment
    template : SmoothSurface
        Undeformed surface, object frame.
    table : IndentationModel
        Of the pressed point.
    support : Support
    options : Fit

    Raises
    ------
    ValueError
        If the tip never touches, force and depth contradict each other, or no frame or sample is
        left.
    """
    check_belonging(record, motion)
    turn = alignment.camera_from_object[:3, :3]
    tips = to_object(alignment.camera_from_object, record.tips_m)
    declared = _contact(record, template, tips, turn, table.direction, table.radius_m, options)
    offset_std_m = float(np.hypot(record.tip_std_m, options.offset_std_m))
    tip_root = record.uncertainty.tip_root_m(options.place_std_m)
    beside = rocking_axes(table.direction)
    # At the greatest force, in the target's frame, in which the tip's error stands.
    held = record.turns[int(np.argmax(record.forces_n @ (turn @ table.direction)))].T @ turn
    tip_axes = np.stack([table.direction, *beside]) @ held.T
    zero_std_m = np.hypot(offset_std_m, np.linalg.norm(tip_axes[0] @ tip_root))
    declared.check(zero_std_m=float(zero_std_m))
    touch = declared.first_touch(tips, table.direction)
    place = object_from_table(table, template, touch)
    beside_m = to_object(place, touch[None])[0] - (table.point_m - table.radius_m * table.direction)
    # A table that turned with the surface is of a press that turned too.
    direction = place[:3, :3] @ table.direction
    contact = _contact(record, template, tips, turn, direction, table.radius_m, options)
    depth, force, onset = contact.depth_m, contact.force_n, contact.onset
    across = record.forces_n - np.outer(force, turn @ direction)
    loaded = loaded_frames(depth, force, onset, contact.least_n, tip_std_m=record.tip_std_m)
    frames = loaded[contact.pressed_m[loaded] <= table.depth_m[-1]]
    if not len(frames):
        raise ValueError(
            "table: expected frames in contact within its"
            f" {table.depth_m[-1] * 1e3:.1f} mm, found none (indenter.radius_m, template"
            " or transforms of the probe wrong, or a deeper table wanted?)"
        )
    axis = tips[frames].mean(axis=0)
    along = MotionAlong.of(motion)
    sharp_edges = sharp_edge_distance(template.vertices_m, template.faces, along.cell_m)
    smooth = sharp_edges > options.crease_m
    deepest = contact.pressed_m[frames].max()
    chosen = _outside(along, axis, direction, deepest, smooth, options, radius_m=table.radius_m)
    if not np.isfinite(along.moved_m[np.ix_(frames, chosen)]).any():
        raise ValueError(
            "samples: expected some that are seen while the tip presses, found all hidden"
        )
    rest = force[: max(onset - 1, 2)]
    noise = np.hypot(along.std_m[np.ix_(frames, chosen)], along.rest_std_m[chosen])
    cell_m, way, axes = along.cell_m[chosen], along.way[chosen], along.axis[chosen]
    return DirectIndentation(
        time_s=record.time_s,
        force_n=force,
        sideways_n=np.linalg.norm(across, axis=1),
        tip_depth_m=depth,
        frames=frames,
        frames_beyond=len(loaded) - len(frames),
        oblique_rad=oblique(tips[onset - 1], tips[int(np.argmax(depth))], direction),
        depth_m=depth[frames],
        speed_m_s=np.gradient(depth, record.time_s)[frames],
        tip_std_m=record.tip_std_m,
        pattern_std_m=options.depth_pattern_std_m,
        depth_root_m=record.tip_std_m * np.eye(len(frames)),
        offset_std_m=offset_std_m,
        clock_expected_s=record.clock_offset_s,
        clock_std_s=record.clock_std_s,
        force_std_n=float(max(FROM_MEDIAN * np.median(np.abs(rest - np.median(rest))), 1e-4)),
        shift_std_m=options.shift_std_m,
        place_expected_m=beside @ beside_m,
        place_std_m=np.sqrt(1 - TIP_PART) * options.place_std_m,
        picture_std_m=options.picture_std_m,
        contact_m=axis,
        cell_m=cell_m,
        way=way,
        axis=axes,
        moved_m=along.moved_m[np.ix_(frames, chosen)],
        noise_std_m=noise,
        moved_std_m=noise,
        patch_m=options.patch_m,
        cluster=patches_of(cell_m, axes, [options.patch_m] * KINDS),
        support_axes=support_axes_of(
            cell_m,
            way,
            support=support,
            contact_m=axis,
            direction=direction,
            options=options,
        ),
        table=sample_table(
            table,
            to_object(place, cell_m),
            way @ place[:3, :3],
            material=axes > 0,
            window_m=along.window_m[chosen] @ place[:3, :3],
        ),
        turned_m_s2=turned_gravity(record.turns, turn @ support.up, turn @ direction),
        tip_root_m=tip_root,
        tip_axes=tip_axes,
        across=beside,
    )


def check_belonging(
    record: ProbeRecord,
    motion: SurfaceMotion,
) -> None:
    """Refuse poses, forces and motion of different recordings.

    Raises
    ------
    ValueError
        If they have different numbers of frames, or a pose or force is no number.
    """
    counts = {len(record.time_s), len(record.forces_n), len(motion.moved_m)}
    if len(counts) > 1:
        raise ValueError(
            f"frames: expected as many in poses, forces and motion, found {sorted(counts)}"
        )
    if not (np.isfinite(record.tips_m).all() and np.isfinite(record.forces_n).all()):
        raise ValueError("tip: expected numbers in all frames, found NaN or infinity")
    if not record.tip_std_m > 0:
        raise ValueError(f"tip: expected a deviation above 0 m, found {record.tip_std_m}")


def _contact(
    record: ProbeRecord,
    template: SmoothSurface,
    tips_m: NDArray,
    turn: NDArray,
    direction: NDArray,
    radius_m: float,
    options: Fit,
) -> Contact:
    force = record.forces_n @ (turn @ direction)
    # The board goes down farther than the tip by what the probe between them gives way.
    gone = force / record.stiffness_n_m
    return Contact.of(
        depth_along(template, tips_m, direction, radius_m=radius_m) - gone, force, options
    )


def _outside(
    motion: MotionAlong,
    axis: NDArray,
    direction: NDArray,
    deepest_m: float,
    smooth: NDArray,
    options: Fit,
    *,
    radius_m: float,
) -> NDArray:
    """Samples away from creases, far enough from the contact and near enough to move."""
    a = hertz_contact_radius(indenter_radius_m=radius_m, depth_m=max(deepest_m, 1e-6))
    way = motion.cell_m - axis
    across = way - (way @ direction)[:, None] * direction
    distance = np.linalg.norm(across, axis=1)
    nearest = options.nearest_radii * a + options.nearest_m
    straight = np.linalg.norm(way, axis=1)
    chosen = np.flatnonzero(smooth & (distance > nearest) & (straight < options.farthest_m))
    if not len(chosen):
        raise ValueError(
            f"samples: expected some from {nearest * 1e3:.0f} to {options.farthest_m * 1e3:.0f} mm"
            " from the contact, found none"
        )
    return chosen
