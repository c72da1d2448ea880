"""What one capture gives to a tracker."""

from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment
from palpate.surface.template import Template


@dataclass(frozen=True)
class Recorded:
    """What one capture gives to a tracker.

    Attributes
    ----------
    template : Template
        Undeformed, object frame.
    solid : SolidMesh
        The object's solid mesh, object frame.
    support : Support
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        One for each frame, camera frame.
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].
    forces_n : (f, 3) array
        Force on the object in each frame, camera frame [N].
    indenter_radius_m : float
    alignment : Alignment
        Of the template with the first frame.
    """

    template: Template
    solid: SolidMesh
    support: Support
    clouds: Sequence[tuple[NDArray, NDArray]]
    tips_m: NDArray
    forces_n: NDArray
    indenter_radius_m: float
    alignment: Alignment
