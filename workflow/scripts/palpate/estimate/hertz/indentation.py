"""Which samples of a capture are an indentation and its hold, and how deep they are."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.hertz import laws
from palpate.estimate.hertz.laws import FOOT, LARGEST_CHI, LAYERS, SUPPORTS, Law, contact_law
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.shape import Shape, shape_at
from palpate.open3d_core import ClosestPoints
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment, thickness_along
from palpate.surface.pose import to_object
from palpate.surface.template import Template
from palpate.units import FROM_MEDIAN

# Largest distance from the surface at which force may begin: tracking, frame rate and clocks leave
# a few mm [m].
FARTHEST_ONSET_M = 0.005
# A rise of so many deviations of the resting force is none.
NOISE_DEVIATIONS = 3.0
# A probe that has risen by this part of the maximum depth, or by so many deviations of the depth's
# own error, is no longer held.
RISEN, RISEN_DEVIATIONS = 0.1, 4.0
# Of the forces at rest, to know their scatter, and of those in contact.
FEWEST_AT_REST, FEWEST_IN_CONTACT = 3, 4


@dataclass(frozen=True)
class Indentation:
    """Samples of an indentation with its approach and hold, and what their fit needs.

    Attributes
    ----------
    time_s, depth_m, force_n : (n,) arrays
        Times [s], depths below the undeformed surface [m] and forces along the indentation [N].
    magnitude_n : (n,) array
        Of the force, which the study's fit takes [N].
    onset, deepest : int
        First sample in contact, and that with which the loading ends.
    radius_m, thickness_m : float
        Of the sphere, and of the object along the indentation [m].
    frame_std_m, contact_std_m : float
        Standard deviation of each depth's own error, and of the error that all depths share [m].
    force_std_n : float
        Of each force's own error, and of the error that all forces share; 0 if too few samples
        are at rest to know it [N].
    shape : Shape
        Of the object at the contact.
    """

    time_s: NDArray
    depth_m: NDArray
    force_n: NDArray
    magnitude_n: NDArray
    onset: int
    deepest: int
    radius_m: float
    thickness_m: float
    frame_std_m: float
    contact_std_m: float
    force_std_n: float
    shape: Shape = field(default_factory=Shape)

    @property
    def approach(self) -> slice:
        """Samples to the end of the loading."""
        return slice(self.deepest + 1)

    @property
    def loading(self) -> slice:
        """Samples from the onset to the end of the loading."""
        return slice(self.onset, self.deepest + 1)

    @property
    def held_s(self) -> float:
        """Length of the hold [s]."""
        return float(self.time_s[-1] - self.time_s[self.deepest])

    @property
    def allows_relaxation(self) -> bool:
        """Whether there are samples enough for a fit with relaxation."""
        in_contact = int((self.depth_m[self.onset :] > 0).sum())
        return self.force_std_n > 0 and in_contact >= FEWEST_IN_CONTACT

    @property
    def depth_over_radius(self) -> float:
        """Maximum depth over the sphere's radius."""
        return max(float(self.depth_m[self.approach].max()), 0.0) / self.radius_m

    @property
    def chi(self) -> float:
        """Largest sqrt(R d)/h."""
        return self.radius_m * float(np.sqrt(self.depth_over_radius)) / self.thickness_m

    @property
    def indenter(self) -> str:
        """Sneddon's sphere beyond a depth of a tenth of the radius, else the paraboloid."""
        return "sneddon" if self.depth_over_radius > laws.SHALLOW else "parabola"

    @property
    def thin(self) -> bool:
        """Whether the object is a layer thinner than the series holds for."""
        return self.shape.support in LAYERS and self.chi > LARGEST_CHI

    @property
    def supports(self) -> tuple[str, ...]:
        """Of the recommended model, then of those that its interval reaches to if no law holds."""
        if not self.shape.warnings:
            return ("half_space",) if self.thin else (self.shape.support,)
        if self.shape.support == FOOT:
            return (FOOT, SUPPORTS[0])
        return SUPPORTS if self.chi <= LARGEST_CHI else SUPPORTS[:1]

    def law(self, indenter: str, support: str, nu: float) -> Law:
        """Force over depth at E* = 1 (`contact_law`)."""
        size = {"radius_m": self.radius_m, "thickness_m": self.thickness_m, "nu": nu}
        names = ("curvature_per_m", "foot_curvature_per_m")
        bent = {name: getattr(self.shape, name) for name in names}
        return contact_law(indenter, support, **size, **bent)


def indentation_of(
    template: Template,
    support: Support,
    alignment: Alignment,
    tips_m: NDArray,
    forces_n: NDArray,
    time_s: NDArray,
    *,
    radius_m: float,
    tip_std_m: float,
    options: Hertz,
) -> tuple[Indentation, dict]:
    """Find an indentation with its hold, and the ``range`` and ``samples`` of hertz.json.

    Of centres of the sphere of ``radius_m`` and forces on the object, (f, 3) each in the camera
    frame [m, N], at times (f,) [s]; ``tip_std_m`` is the deviation of a tip along the probe's axis
    [m].

    Raises
    ------
    ValueError
        ``force``, ``depth`` or ``direction``: if there is no indentation, it begins elsewhere than
        at the surface, or the object has no thickness under it.
    """
    magnitude = np.linalg.norm(forces_n, axis=1)
    depth = indentation_depth(template, alignment, tips_m, radius_m=radius_m)
    start, stop = hertz_range(magnitude, onset_force_n=options.onset_force_n)
    if abs(depth[start]) > FARTHEST_ONSET_M:
        place = "below" if depth[start] > 0 else "above"
        raise ValueError(
            f"depth: expected the tip within {FARTHEST_ONSET_M * 1e3:g} mm of the surface when the"
            f" force begins, found it {abs(depth[start]) * 1e3:.1f} mm {place} in frame {start}"
            " (square_m, indenter.radius_m and transforms of the probe, optics, clocks?)"
        )
    end = hold_end(depth, stop, frame_std_m=tip_std_m)
    # A magnitude has a positive mean where there is noise alone, and counts what goes across as
    # stiffness.
    held = forces_n[stop:end].mean(axis=0)
    along = forces_n @ (held / np.linalg.norm(held))
    std, used = float(np.hypot(tip_std_m, options.offset_std_m)), slice(end)
    direction = alignment.camera_from_object[:3, :3].T @ (tips_m[stop] - tips_m[start - 1])
    # An offset can leave no depth at all.
    known = {"radius_m": radius_m, "depth_m": max(float(depth[: stop + 1].max()), std)}
    rest = forces_n[: max(start - 1, 0)]
    # Of all components, about their means.
    noise = np.sqrt(rest.var(axis=0, ddof=1).mean()) if len(rest) >= FEWEST_AT_REST else 0.0
    indentation = Indentation(
        time_s=time_s[used],
        depth_m=depth[used],
        force_n=along[used],
        magnitude_n=magnitude[used],
        onset=start,
        deepest=stop,
        radius_m=radius_m,
        thickness_m=thickness_along(template, alignment.contact_point_m, direction),
        frame_std_m=float(tip_std_m),
        contact_std_m=std,
        force_std_n=float(noise),
        shape=shape_at(template, support, alignment.contact_point_m, direction, **known),
    )
    samples = {
        "range": {"first_frame": start, "last_frame": stop},
        "samples": {"depth_m": depth.tolist(), "force_n": magnitude.tolist()},
    }
    return indentation, samples


def force_onset(force_n: NDArray, *, onset_force_n: float) -> int:
    """First sample of the loading from which the force stays above a threshold.

    Of the force's magnitude (n,) [N] and the smallest that counts as contact [N].

    Raises
    ------
    ValueError
        If the force never exceeds the threshold, or does so from the first sample.
    """
    peak = int(np.argmax(force_n))
    if force_n[peak] <= onset_force_n:
        found = f"{force_n[peak]:.3g}"
        raise ValueError(f"force: expected above {onset_force_n:g} N, found at most {found} N")
    below = np.flatnonzero(force_n[:peak] <= onset_force_n)
    if not len(below):
        raise ValueError("force: expected samples before contact, found contact from the first")
    return int(below[-1]) + 1


def noise_of(resting: NDArray) -> float:
    """Deviation of forces (k,) at rest about their median, of their unit."""
    return FROM_MEDIAN * float(np.median(np.abs(resting - np.median(resting))))


def hertz_range(force_n: NDArray, *, onset_force_n: float) -> tuple[int, int]:
    """First and last sample from the onset of force to where it starts to fall (Section 5.1).

    The highest force of a hold is any of its samples but for relaxation. The range therefore ends
    with the first that comes within the resting force's noise of the highest. Parameters and errors
    are those of `force_onset`.
    """
    start = force_onset(force_n, onset_force_n=onset_force_n)
    least = force_n.max() - NOISE_DEVIATIONS * noise_of(force_n[: max(start - 1, 1)])
    high = force_n[start:] >= least
    return start, start + int(np.argmax(high))


def indentation_depth(
    template: Template, alignment: Alignment, tips_m: NDArray, *, radius_m: float
) -> NDArray:
    """Depth of the sphere's lowest point below the undeformed surface, (f,) [m].

    Of centres of the sphere in each frame, (f, 3) in the camera frame [m], and its radius [m].
    """
    surface = ClosestPoints(template.vertices_m, template.faces)
    return radius_m - surface.signed_distance(to_object(alignment.camera_from_object, tips_m))


def hold_end(depth_m: NDArray, deepest: int, *, frame_std_m: float) -> int:
    """Number of samples up to the end of the hold, the deepest among them.

    Of depths below the undeformed surface (n,) [m], the sample with which the loading ends, and the
    standard deviation of each depth's own error [m].
    """
    reached = float(depth_m[: deepest + 1].max())
    risen = depth_m[deepest:] < reached - max(RISEN * reached, RISEN_DEVIATIONS * frame_std_m)
    return deepest + max(int(np.argmax(risen)) if risen.any() else len(risen), 1)
