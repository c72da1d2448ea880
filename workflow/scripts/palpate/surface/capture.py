"""The template aligned with the first frame of a capture."""

from collections.abc import Mapping

from numpy.typing import NDArray

from palpate.solid.support import Support
from palpate.surface.alignment import Alignment, align_capture, resting_prior
from palpate.surface.checks import require_fit
from palpate.surface.options import Aligning
from palpate.surface.template import Template


def align_first(
    template: Template,
    support: Support,
    point: Mapping,
    plane: NDArray,
    cloud: tuple[NDArray, NDArray],
    tips_m: NDArray,
    onset: int,
    peak: int,
    options: Aligning,
    *,
    indenter_radius_m: float,
) -> Alignment:
    """Align the template with the first frame, and reject what the data contradict.

    Parameters
    ----------
    template : Template
        Undeformed, object frame.
    support : Support
    point : mapping
        Declared ``position_m`` and, where the press is not straight down, ``direction``.
    plane : (4,) array
        The table, camera frame.
    cloud : (points (n, 3) [m], normals (n, 3))
        Of the first frame, camera frame.
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].
    onset, peak : int
        First frame with force, and that with the most.
    options : Aligning
    indenter_radius_m : float

    Raises
    ------
    ValueError
        If too little of the cloud lies near the template, or a limit does not hold.
    """
    resting = resting_prior(
        template, support, point, plane, tips_m, onset, peak, indenter_radius_m=indenter_radius_m
    )
    found = align_capture(
        template,
        cloud,
        resting,
        tips_m,
        onset,
        largest_distance_m=options.largest_distance_m,
        largest_normal_deg=options.largest_normal_deg,
    )
    require_fit(
        found,
        template,
        cloud[0],
        resting,
        tips_m[onset],
        options.limits,
        largest_distance_m=options.largest_distance_m,
        indenter_radius_m=indenter_radius_m,
    )
    return found
