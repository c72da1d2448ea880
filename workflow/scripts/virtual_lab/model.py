"""What the contact solver needs of an object, and how pictures get its surface."""

from collections.abc import Callable
from dataclasses import dataclass

from numpy.typing import NDArray

from virtual_lab.mesh import SolidMesh
from virtual_lab.obstacle import Table


@dataclass(frozen=True)
class Model:
    """An object, discretised to be pressed at one point.

    Attributes
    ----------
    solid : SolidMesh
        With the patch ``top``, and ``bottom`` where a table is an obstacle.
    fixed : (n, 3) bool array
        Displacements that are held at zero.
    supports : tuple of Table
        Obstacles besides the probe.
    mirrors : tuple of int
        Axes along which the other half of the object is the mirror image of what is solved.
    surface_rest_m : (k, 3) array
        Closed undeformed surface, object frame [m].
    surface_faces : (m, 3) int array
        Its triangles, outward.
    sample : callable
        Nodal displacements (n, 3) to those of the surface (k, 3) [m].
    """

    solid: SolidMesh
    fixed: NDArray
    supports: tuple[Table, ...]
    mirrors: tuple[int, ...]
    surface_rest_m: NDArray
    surface_faces: NDArray
    sample: Callable[[NDArray], NDArray]
