"""A plane that a solid stands on without being bonded to it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from palpate.solid.mesh import SolidMesh, at_nodes, doubled_normals
from palpate.solid.obstacle import (
    PENALTY_PER_M,
    SurfacePoints,
    Touch,
    plane_touch,
    surface_points,
    touch_blocks,
    touch_energy,
    touch_forces,
)
from palpate.solid.support import Support

# Stiffness that holds a node sideways, over Young's modulus; elements have a hundredth [m].
PIN_M = 1.0
# Nodes held: how far down from the touch to the table, as parts of the way.
PINNED = (0.35, 0.65)
# Parts of an edge for the quadrature: the border of what stands runs through the faces.
PARTS = 4


@dataclass
class Table:
    """A plane that points of the surface press; where they touched it, they stick or slide.

    Nothing keeps a round object from rolling off under a frictionless sphere but the hand's
    friction, and nothing from spinning: two nodes on the line of the press are held sideways, and
    one far from it against turning around it.

    Attributes
    ----------
    surface : SurfacePoints
        That may touch.
    point_m, normal : (3,) arrays
        Of the plane; the normal has length 1.
    pinned : (p,) int array
        Nodes that are held.
    pinned_m : (p, 3) array
        Where [m].
    pins_m : (p, 3, 3) array
        Stiffness that holds them over Young's modulus [m].
    sticks : bool, optional
        Whether points that touch stick; else they slide freely.
    anchors_m : (f, q, 3) array
        Where the points touched first; NaN where they have not yet [m].
    """

    surface: SurfacePoints
    point_m: NDArray
    normal: NDArray
    pinned: NDArray
    pinned_m: NDArray
    pins_m: NDArray
    sticks: bool = True
    anchors_m: NDArray = field(init=False)

    def __post_init__(self) -> None:
        self.anchors_m = np.full((*self.surface.areas_m2.shape, 3), np.nan)

    def energy(self, x: NDArray) -> float:
        """Energy over Young's modulus [m^3]."""
        touch, slid, stiff = self._state(x)
        sliding = 0.5 * (stiff * self.surface.areas_m2[touch.points]) @ (slid**2).sum(axis=1)
        held = 0.5 * (self._pulls(x) * (x[self.pinned] - self.pinned_m)).sum()
        return touch_energy(touch, self.surface) + float(sliding + held)

    def forces(self, x: NDArray) -> NDArray:
        """Gradient of the energy, shape (n, 3) [m^2]."""
        touch, slid, stiff = self._state(x)
        faces, inside = touch.points
        shear = (stiff * self.surface.areas_m2[touch.points])[:, None] * slid
        pull = self.surface.shapes[inside][:, :, None] * shear[:, None, :]
        forces = touch_forces(touch, self.surface, len(x))
        forces += at_nodes(self.surface.faces[faces], pull, len(x))
        forces[self.pinned] += self._pulls(x)
        return forces

    def blocks(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Faces in touch and their second derivatives, as `touch_blocks` gives them."""
        touch, _, stiff = self._state(x)
        return touch_blocks(touch, self.surface, stick_per_m=stiff)

    def settle(self, x: NDArray) -> None:
        """Let the points that touch by now stick where they are; free those that left."""
        if not self.sticks:
            return
        places = self.surface.places(x)
        touch = plane_touch(places, self.point_m, self.normal)
        anchors = np.full_like(self.anchors_m, np.nan)
        old = self.anchors_m[touch.points]
        anchors[touch.points] = np.where(np.isnan(old), places[touch.points], old)
        self.anchors_m = anchors

    def _pulls(self, x: NDArray) -> NDArray:
        """Gradient of the held nodes' energy, shape (p, 3) [m^2]."""
        return np.einsum("pab,pb->pa", self.pins_m, x[self.pinned] - self.pinned_m)

    def _state(self, x: NDArray) -> tuple[Touch, NDArray, NDArray]:
        """Touch, how far its points slid from where they stuck (k, 3), stiffness against it."""
        places = self.surface.places(x)
        touch = plane_touch(places, self.point_m, self.normal)
        slid = places[touch.points] - self.anchors_m[touch.points]
        sticks = ~np.isnan(slid[:, 0])
        slid = np.where(sticks[:, None], slid, 0.0)
        slid = slid - (slid @ self.normal)[:, None] * self.normal
        return touch, slid, np.where(sticks, PENALTY_PER_M, 0.0)


def standing_table(
    mesh: SolidMesh, support: Support, touch_m: NDArray, *, reach_m: float, sticks: bool = True
) -> Table:
    """Table at the lowest point of a solid.

    Parameters
    ----------
    mesh : SolidMesh
        Ten-node elements.
    support : Support
        Its normal; the plane is moved along it until it touches the solid.
    touch_m : (3,) array
        Where the solid is pressed [m].
    reach_m : float
        Faces below this height may come down to the table [m].
    sticks : bool, optional
        As `Table` has it.
    """
    normal, faces = support.up, mesh.surface_faces()
    heights = mesh.nodes_m[faces] @ normal
    lowest = float(heights.min())
    low = (heights.min(axis=1) < lowest + reach_m) & (
        doubled_normals(mesh.nodes_m, faces) @ normal < 0
    )
    height = touch_m @ normal - lowest
    line = touch_m - np.outer(PINNED, height * normal)
    away = mesh.nodes_m - touch_m
    beside = away - np.outer(away @ normal, normal)
    far = int(np.argmax((beside**2).sum(axis=1)))
    around = np.cross(normal, beside[far] / np.linalg.norm(beside[far]))
    pinned = np.append(cKDTree(mesh.nodes_m).query(line)[1], far)
    sideways = np.eye(3) - np.outer(normal, normal)
    return Table(
        surface=surface_points(mesh, faces[low], parts=PARTS),
        point_m=lowest * normal,
        normal=normal,
        pinned=pinned,
        pinned_m=mesh.nodes_m[pinned],
        pins_m=PIN_M * np.stack([sideways, sideways, np.outer(around, around)]),
        sticks=sticks,
    )
