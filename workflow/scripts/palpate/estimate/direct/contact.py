"""An indentation along a line: depth, force, where the one begins, and where its table lies."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.table import axes_across
from palpate.estimate.hertz.indentation import FEWEST_AT_REST, force_onset, hold_end, noise_of
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.pose import to_camera

# Of the force at rest, that the force of a frame must exceed.
FORCE_DEVIATIONS = 6
# A sphere is led to the surface from so far outside, until it is as near as this; still so far from
# it after all steps, it was never led there [m].
OUTSIDE_M, TOUCHING_M, MARCHES, UNFINISHED_M = 0.08, 1e-7, 200, 1e-5
# Farther from the surface than tip and template are wrong by, a tip touches nothing.
CLEAR_M = 0.003
# Deviations of what is known of the depth's zero that it may be off.
LIKELY = 2.5
# Frames at least so deep, as a part of the deepest, show where the contact is; and a tip that has
# gone no farther than this part of its way is still at rest.
DEEP, MOVED = 0.5, 0.01
# The surface moves most within so many of the sphere's radii around the contact, and is to go on
# alike so far; scans and their meshes agree to about the second [m].
REACH_RADII, ALIKE_M = 4.0, 0.0005
# Where it does not, a table so far from the contact still has its force and displacement [m].
NEAREST_M = 0.002
# Gauss and Newton's steps of the turn; farther off another part of the object is indented [m].
TURNS, FARTHEST_M = 6, 0.015


@dataclass(frozen=True)
class Contact:
    """Depth and force along an indentation.

    Attributes
    ----------
    depth_m, force_n : (f,) arrays
        Below the undeformed surface, by the template and the tips [m], and on the object [N].
    least_n : float
        Force from which on frames are compared [N].
    onset : int
        First frame with such a force from which on it stays.
    """

    depth_m: NDArray
    force_n: NDArray
    least_n: float
    onset: int

    @classmethod
    def of(cls, depth_m: NDArray, force_n: NDArray, options: Fit) -> "Contact":
        """Find the onset.

        Raises
        ------
        ValueError
            If there is no force, or there is one from the first frame.
        """
        # Above the noise, and enough of the peak.
        noise_n = noise_of(force_n[unloaded(depth_m, force_n)])
        least = max(FORCE_DEVIATIONS * noise_n, options.least_force_share * force_n.max())
        return cls(depth_m, force_n, least, force_onset(force_n, onset_force_n=least))

    @property
    def zero_m(self) -> float:
        """Depth at which the force begins [m]: 0, or what is nearest to it between two frames.

        Tip, alignment and template err by millimetres together.
        """
        between = self.depth_m[[max(self.onset - 1, 0), self.onset]]
        return float(np.clip(0.0, between.min(), between.max()))

    @property
    def pressed_m(self) -> NDArray:
        """Way since the force began, (f,) [m]."""
        return self.depth_m - self.zero_m

    def check(self, *, zero_std_m: float) -> None:
        """Reject an indentation whose force and depth contradict each other.

        ``zero_std_m`` is the standard deviation of the depth's zero [m].

        Raises
        ------
        ValueError
            If the sphere never comes as near to the surface as its zero is known, or is deeper in
            it when the force begins, the force is largest where the tip is not pressed in, or the
            work of the indentation is not positive.
        """
        deepest_m, limit_m = self.depth_m[self.onset :].max(), LIKELY * zero_std_m
        within = f"within {limit_m * 1e3:.1f} mm as direct.fit.offset_std_m says, found it"
        why = "(template, alignment, indenter.radius_m or transforms of the probe wrong?)"
        if not deepest_m + limit_m > 0:
            raise ValueError(
                f"depth: expected a tip that touches the template while there is force, {within}"
                f" {-deepest_m * 1e3:.1f} mm away at its deepest {why}"
            )
        if self.zero_m > limit_m:
            raise ValueError(
                f"depth: expected a force that begins where the tip touches the template, {within}"
                f" {self.zero_m * 1e3:.1f} mm inside {why}"
            )
        peak = int(np.argmax(self.force_n))
        if self.pressed_m[peak] <= 0:
            raise ValueError(
                f"force: expected its peak while the tip presses, found it in frame {peak},"
                f" {-self.pressed_m[peak] * 1e3:.1f} mm above where the force begins"
            )
        loading = slice(max(self.onset - 1, 0), int(np.argmax(self.depth_m)) + 1)
        work_j = float(np.trapezoid(self.force_n[loading], self.depth_m[loading]))
        if not work_j > 0:
            raise ValueError(
                f"force: expected a press that does work on the object, found {work_j:.2g} J up to"
                " the deepest frame"
            )

    def first_touch(self, tips_m: NDArray, direction: NDArray) -> NDArray:
        """Centre of the sphere when it first touched, by the way of the deepest tips, (3,) [m].

        Of its centres ``tips_m`` (f, 3), object frame [m], and the unit vector (3,) of the
        indentation.
        """
        deep = self.pressed_m > DEEP * self.pressed_m.max()
        return (tips_m - self.depth_m[:, None] * direction)[deep].mean(axis=0)

    def loaded_frames(self, *, tip_std_m: float) -> NDArray:
        """Frames from the onset to the end of the hold with force enough, (k,).

        The elastic force follows from a record's history while the contact grows or is held; that
        of a release needs another law (T. C. T. Ting, J. Appl. Mech. 33, 1966, 845). ``tip_std_m``
        is the deviation of a depth from frame to frame [m].
        """
        end = hold_end(self.depth_m, int(np.argmax(self.depth_m)), frame_std_m=tip_std_m)
        return self.onset + np.flatnonzero(self.force_n[self.onset : end] > self.least_n)


def unloaded(depth_m: NDArray, force_n: NDArray) -> NDArray:
    """Frames that are known to be unloaded, (k,): before the peak, the tip clear of the object.

    Where it never is, those in which it has not moved from where it began, three at least. Of the
    depth below the undeformed surface (f,) [m] and the force along the indentation (f,) [N].
    """
    clear = np.flatnonzero(depth_m[: int(np.argmax(force_n))] < -CLEAR_M)
    if len(clear) >= FEWEST_AT_REST:
        return clear
    moved = depth_m > depth_m[:FEWEST_AT_REST].max() + MOVED * np.ptp(depth_m)
    still = int(np.argmax(moved)) if moved.any() else 0
    return np.arange(max(still, FEWEST_AT_REST))


def depth_along(
    surface: SmoothSurface, tips_m: NDArray, direction: NDArray, *, radius_m: float
) -> NDArray:
    """Way of a sphere along the indentation since it first touches the surface, (f,) [m].

    Of the undeformed surface, object frame, centres ``tips_m`` (f, 3) of the sphere in it [m], and
    the unit vector (3,) of the indentation, into the object.

    Raises
    ------
    ValueError
        If a way along the indentation does not meet the surface.
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
        expected = "expected a way along the press that meets the surface"
        raise ValueError(f"tip: {expected}, found none in frame {lost[0]}")
    return OUTSIDE_M - way


def object_from_table(
    table: IndentationModel, surface: SmoothSurface, centre_m: NDArray
) -> NDArray:
    """Rigid motion that brings a table's first touch to that of an indentation, (4, 4).

    Along the surface and turned with it, as far as the surface lies on itself then, as a flat face
    far from its edges does, and a ball all around; the unit matrix where it does not, and the
    contact is near enough. Of the undeformed template and the sphere's centre when it first
    touched, (3,) in the object frame [m].

    Raises
    ------
    ValueError
        If the contact is not.
    """
    start = table.point_m - table.radius_m * table.direction
    way = centre_m - start
    away = float(np.linalg.norm(way - (way @ table.direction) * table.direction))
    apart = np.linalg.norm(table.surface_rest_m - table.point_m, axis=1)
    near = table.surface_rest_m[apart < REACH_RADII * table.radius_m]
    if away <= FARTHEST_M:
        moved = _moved(surface, near, way, centre_m, table.direction)
        gap = surface.distance(to_camera(moved, near)) - surface.distance(near)
        if gap.max() < ALIKE_M:
            return moved
    if away > NEAREST_M:
        point = np.round(surface.nearest(centre_m[None])[0], 4).tolist()
        raise ValueError(
            f"contact: expected within {NEAREST_M * 1e3:g} mm of the declared point, beside which"
            f" the surface is another, found {away * 1e3:.1f} mm away (a point of its own, with"
            f" position_m {point}?)"
        )
    return np.eye(4)


def _moved(
    surface: SmoothSurface, near_m: NDArray, way_m: NDArray, centre_m: NDArray, direction: NDArray
) -> NDArray:
    """Bring the near surface (k, 3) there, turned to lie on the surface as it can, (4, 4)."""
    # A facet's normals would not do: 5 degrees lift what is four radii away by 2 mm.
    axes = axes_across(direction)
    found = np.eye(4)
    found[:3, 3] = way_m
    for _ in range(TURNS):
        at = to_camera(found, near_m)
        normals = surface.normals(at)
        gap = ((at - surface.nearest(at)) * normals).sum(axis=1)
        tilts = [(np.cross(axis, at - centre_m) * normals).sum(axis=1) for axis in axes]
        slopes = np.column_stack([*tilts, normals @ direction])
        *tilt, along = -np.linalg.lstsq(slopes, gap, rcond=None)[0]
        turn = Rotation.from_rotvec(tilt @ axes).as_matrix()
        found[:3] = turn @ found[:3]
        found[:3, 3] += centre_m - turn @ centre_m + along * direction
    return found
