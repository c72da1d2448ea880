"""From a capture's motion, poses and forces to what the direct estimate compares."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.indentation import KINDS, DirectIndentation, patches_of
from palpate.estimate.direct.motion import MotionAlong, SurfaceMotion
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.placement import object_from_table
from palpate.estimate.direct.support_motion import rocking_axes, support_axes_of
from palpate.estimate.direct.table import sample_table
from palpate.estimate.hertz.range import FROM_MEDIAN, force_onset
from palpate.estimate.hertz.record import FEWEST_AT_REST, hold_end
from palpate.solid.contact_pressure import hertz_contact_radius
from palpate.solid.indentation import IndentationModel
from palpate.solid.smooth_surface import SmoothSurface
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from palpate.surface.sharp_edges import sharp_edge_distance

# A sphere is led to the surface from so far outside [m], until it is as near as this.
OUTSIDE_M, TOUCHING_M, MARCHES = 0.08, 1e-7, 200
# Still so far from it after all those steps, it was never led there.
UNFINISHED_M = 1e-5
# Farther from the surface than tip and template are wrong by, a tip touches nothing.
CLEAR_M = 0.003
# Where the contact is is told by frames at least so deep, as a part of the deepest.
PRESSED = 0.5
# And a tip that has gone no farther than this part of its way is still at rest.
MOVED = 0.01


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
    """

    time_s: NDArray
    tips_m: NDArray
    forces_n: NDArray
    tip_std_m: float
    stiffness_n_m: float
    clock_offset_s: float
    clock_std_s: float


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
    touch = first_touch(template, tips, table)
    place = object_from_table(table, template, touch)
    beside_m = to_object(place, touch[None])[0] - (table.point_m - table.radius_m * table.direction)
    # A table that turned with the surface is of a press that turned too.
    direction = place[:3, :3] @ table.direction
    depth = depth_along(template, tips, direction, radius_m=table.radius_m)
    force = record.forces_n @ (turn @ direction)
    across = record.forces_n - np.outer(force, turn @ direction)
    # The board goes down farther than the tip by what the probe between them gives way.
    depth = depth - force / record.stiffness_n_m
    least = least_force(force, unloaded(depth, force), options)
    onset = force_onset(force, onset_force_n=least)
    check_indentation(depth, force, onset)
    loaded = loaded_frames(depth, force, onset, least, tip_std_m=record.tip_std_m)
    frames = loaded[depth[loaded] <= table.depth_m[-1]]
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
    chosen = _outside(
        along, axis, direction, depth[frames].max(), smooth, options, radius_m=table.radius_m
    )
    if not np.isfinite(along.moved_m[np.ix_(frames, chosen)]).any():
        raise ValueError(
            "samples: expected some that are seen while the tip presses, found all hidden"
        )
    rest = force[: max(onset - 1, 2)]
    tip_std = record.tip_std_m
    noise = np.hypot(along.std_m[np.ix_(frames, chosen)], along.rest_std_m[chosen])
    cell_m, way, axes = along.cell_m[chosen], along.way[chosen], along.axis[chosen]
    return DirectIndentation(
        time_s=record.time_s,
        force_n=force,
        sideways_n=np.linalg.norm(across, axis=1),
        frames=frames,
        frames_beyond=len(loaded) - len(frames),
        oblique_rad=oblique(tips[onset - 1], tips[int(np.argmax(depth))], direction),
        depth_m=depth[frames],
        speed_m_s=np.gradient(depth, record.time_s)[frames],
        tip_std_m=tip_std,
        pattern_std_m=options.depth_pattern_std_m,
        depth_root_m=tip_std * np.eye(len(frames)),
        offset_std_m=float(np.hypot(tip_std, options.offset_std_m)),
        clock_expected_s=record.clock_offset_s,
        clock_std_s=record.clock_std_s,
        force_std_n=float(max(FROM_MEDIAN * np.median(np.abs(rest - np.median(rest))), 1e-4)),
        shift_std_m=options.shift_std_m,
        place_expected_m=rocking_axes(table.direction) @ beside_m,
        place_std_m=options.place_std_m,
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
        ),
    )


def loaded_frames(
    depth_m: NDArray, force_n: NDArray, onset: int, least_n: float, *, tip_std_m: float
) -> NDArray:
    """Frames from the onset to the end of the hold with force enough, (k,).

    The elastic force follows from a record's history while the contact grows or is held; that of a
    release needs another law (T. C. T. Ting, J. Appl. Mech. 33, 1966, 845).

    Parameters
    ----------
    depth_m, force_n : (f,) arrays
        Of all frames [m, N].
    onset : int
        First frame in contact.
    least_n : float
        Of `least_force`.
    tip_std_m : float
        Deviation of a depth from frame to frame [m].
    """
    end = hold_end(depth_m, int(np.argmax(depth_m)), frame_std_m=tip_std_m)
    return onset + np.flatnonzero(force_n[onset:end] > least_n)


def first_touch(surface: SmoothSurface, tips_m: NDArray, table: IndentationModel) -> NDArray:
    """Centre of the sphere when it first touched, by the way of the deepest tips, (3,) [m].

    Parameters
    ----------
    surface : SmoothSurface
        Object frame.
    tips_m : (f, 3) array
        Centres of the sphere, object frame [m].
    table : IndentationModel

    Raises
    ------
    ValueError
        If it never did.
    """
    depth = depth_along(surface, tips_m, table.direction, radius_m=table.radius_m)
    if not depth.max() > 0:
        raise ValueError(
            "depth: expected a tip that touches the template, found it"
            f" {-depth.max() * 1e3:.1f} mm away at the nearest (template, alignment,"
            " indenter.radius_m or transforms of the probe wrong?)"
        )
    pressed = depth > PRESSED * depth.max()
    return (tips_m - depth[:, None] * table.direction)[pressed].mean(axis=0)


def oblique(start_m: NDArray, end_m: NDArray, direction: NDArray) -> float:
    """Angle between a tip's way (3,) and the press [rad]."""
    along = float((end_m - start_m) @ direction)
    return float(np.arctan2(np.linalg.norm(np.cross(end_m - start_m, direction)), along))


def unloaded(depth_m: NDArray, force_n: NDArray) -> NDArray:
    """Frames that are known to be unloaded, (k,): before the peak, the tip clear of the object.

    Where it never is, those in which it has not moved from where it began, three at least.

    Parameters
    ----------
    depth_m, force_n : (f,) arrays
        Depth below the undeformed surface [m] and force along the press [N] of all frames.
    """
    clear = np.flatnonzero(depth_m[: int(np.argmax(force_n))] < -CLEAR_M)
    if len(clear) >= FEWEST_AT_REST:
        return clear
    moved = depth_m > depth_m[:FEWEST_AT_REST].max() + MOVED * np.ptp(depth_m)
    still = int(np.argmax(moved)) if moved.any() else 0
    return np.arange(max(still, FEWEST_AT_REST))


def least_force(force_n: NDArray, rest: NDArray, options: Fit) -> float:
    """Force from which on frames are compared: above the noise, and enough of the peak [N].

    Parameters
    ----------
    force_n : (f,) array
        Of all frames [N].
    rest : (k,) int array
        Frames that are known to be unloaded.
    options : Fit
    """
    early = force_n[rest]
    noise = FROM_MEDIAN * float(np.median(np.abs(early - np.median(early))))
    return max(options.force_deviations * noise, options.least_force_share * force_n.max())


def depth_along(
    surface: SmoothSurface, tips_m: NDArray, direction: NDArray, *, radius_m: float
) -> NDArray:
    """Way of a sphere along the press since it first touches the undeformed surface, (f,) [m].

    Parameters
    ----------
    surface : SmoothSurface
        Object frame.
    tips_m : (f, 3) array
        Centres of the sphere, object frame [m].
    direction : (3,) array
        Unit vector of the press, into the object.
    radius_m : float

    Returns
    -------
    (f,) array
        Negative before the touch.

    Raises
    ------
    ValueError
        If a way along the press does not meet the surface.
    """
    start = tips_m - OUTSIDE_M * direction
    way = np.zeros(len(tips_m))
    for _ in range(MARCHES):
        gap = surface.distance(start + way[:, None] * direction) - radius_m
        way += gap
        if np.abs(gap).max() < TOUCHING_M or way.max() > 3 * OUTSIDE_M:
            break
    # A wall beside the way lets a march come to no end.
    lost = np.flatnonzero(~(way < 3 * OUTSIDE_M) | (np.abs(gap) > UNFINISHED_M))
    if len(lost):
        raise ValueError(
            f"tip: expected a way along the press that meets the surface, found none in frame"
            f" {lost[0]}"
        )
    return OUTSIDE_M - way


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


def check_indentation(depth_m: NDArray, force_n: NDArray, onset: int) -> None:
    """Refuse a press whose force and depth contradict each other.

    Raises
    ------
    ValueError
        If the sphere never is below the surface, the force rises where it is not, or the work of
        the press is not positive.
    """
    inside = depth_m[onset:]
    if not inside.max() > 0:
        raise ValueError(
            "depth: expected the tip below the undeformed surface while there is force, found it"
            f" {-inside.max() * 1e3:.1f} mm above at its deepest"
        )
    peak = int(np.argmax(force_n))
    if depth_m[peak] <= 0:
        raise ValueError(
            f"force: expected its peak while the tip presses, found it in frame {peak},"
            f" {-depth_m[peak] * 1e3:.1f} mm above the surface"
        )
    loading = slice(max(onset - 1, 0), int(np.argmax(depth_m)) + 1)
    work_j = float(np.trapezoid(force_n[loading], depth_m[loading]))
    if not work_j > 0:
        raise ValueError(
            f"force: expected a press that does work on the object, found {work_j:.2g} J up to the"
            " deepest frame"
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
