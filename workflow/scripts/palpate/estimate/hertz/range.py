"""Which samples of a press the Hertz model is fitted to, and how deep they are (Section 5.1)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import ClosestPoints
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from palpate.surface.template import Template

# How far from the surface a press may begin: tracking, frame rate and clocks leave a few mm [m].
FARTHEST_ONSET_M = 0.005
# A rise of so many deviations of the resting force is none.
NOISE_DEVIATIONS = 3.0
# Normal distribution: standard deviation over median absolute deviation.
FROM_MEDIAN = 1.4826


@dataclass(frozen=True)
class HertzRange:
    """Samples used for the fit: from the onset of force to the end of deformation, inclusive."""

    start: int
    stop: int


def force_onset(force_n: NDArray, *, onset_force_n: float) -> int:
    """First sample of the loading from which the force stays above a threshold.

    Parameters
    ----------
    force_n : (n,) array
        Magnitude of the force [N].
    onset_force_n : float
        Smallest force that counts as contact [N].

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


def hertz_range(force_n: NDArray, *, onset_force_n: float) -> HertzRange:
    """Samples from the onset of force to where it starts to fall (Section 5.1).

    A probe that holds still keeps its force but for relaxation and noise; the highest sample of
    the hold is then any of them. The range therefore ends with the first sample that comes within
    the resting force's noise of the highest.

    Parameters
    ----------
    force_n : (n,) array
        Magnitude of the force [N].
    onset_force_n : float
        Smallest force that counts as contact [N].

    Raises
    ------
    ValueError
        As `force_onset` does.
    """
    start = force_onset(force_n, onset_force_n=onset_force_n)
    rest = force_n[: max(start - 1, 1)]
    noise = FROM_MEDIAN * float(np.median(np.abs(rest - np.median(rest))))
    high = force_n[start:] >= force_n.max() - NOISE_DEVIATIONS * noise
    return HertzRange(start, start + int(np.argmax(high)))


def indentation_depth(
    template: Template, alignment: Alignment, tips_m: NDArray, *, radius_m: float
) -> NDArray:
    """Depth of the sphere's lowest point below the undeformed surface, (f,) [m].

    Parameters
    ----------
    template : Template
        Undeformed, object frame.
    alignment : Alignment
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].
    radius_m : float
        Of the sphere.
    """
    surface = ClosestPoints(template.vertices_m, template.faces)
    return radius_m - surface.signed_distance(to_object(alignment.camera_from_object, tips_m))


def check_contact(depth_m: NDArray, onset: int) -> None:
    """Refuse a press whose force begins elsewhere than at the surface.

    Parameters
    ----------
    depth_m : (n,) array
        Depth of the sphere's lowest point below the undeformed surface in each frame [m].
    onset : int
        First frame with force.

    Raises
    ------
    ValueError
        If the tip is then more than 5 mm from the surface.
    """
    if abs(depth_m[onset]) > FARTHEST_ONSET_M:
        place = "below" if depth_m[onset] > 0 else "above"
        raise ValueError(
            f"depth: expected the tip within {FARTHEST_ONSET_M * 1e3:g} mm of the surface when the"
            f" force begins, found it {abs(depth_m[onset]) * 1e3:.1f} mm {place} in frame {onset}"
            " (square_m, indenter.radius_m and transforms of the probe, optics, clocks?)"
        )
