"""The plane that an object stands on, and the nodes of a solid that lie on it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh

CONTACTS = ("bonded", "resting")
# A foot whose mean radius is this part of the contact's height.
BROAD = 0.5


@dataclass(frozen=True)
class Support:
    """Plane that an object stands on.

    Attributes
    ----------
    plane_point_m : (3,) array
        A point of the plane [m].
    plane_normal : (3,) array
        Into the object, of any length.
    tolerance_m : float
        What of the surface lies within this distance of the plane is held [m].
    contact : {"bonded", "resting"}, optional
        Whether the object sticks to the plane or stands on it loosely.

    Raises
    ------
    ValueError
        If the normal has no direction, or the contact is unknown.

    Examples
    --------
    >>> ground = Support(np.zeros(3), np.array([0.0, 0.0, 2.0]), tolerance_m=1e-3)
    >>> ground.holds(np.array([[0.1, 0.0, 0.0005], [0.0, 0.0, 0.02]])).tolist()
    [True, False]
    """

    plane_point_m: NDArray
    plane_normal: NDArray
    tolerance_m: float
    contact: str = "bonded"

    def __post_init__(self) -> None:
        if not 0 < np.linalg.norm(self.plane_normal) < np.inf:
            found = np.asarray(self.plane_normal, dtype=float).tolist()
            raise ValueError(f"support.plane_normal: expected a direction, found {found}")
        if self.contact not in CONTACTS:
            expected = f"one of {', '.join(CONTACTS)}"
            raise ValueError(f"support.contact: expected {expected}, found {self.contact}")

    @property
    def up(self) -> NDArray:
        """Unit normal, (3,)."""
        normal = np.asarray(self.plane_normal, dtype=float)
        return normal / np.linalg.norm(normal)

    @property
    def resting(self) -> bool:
        """Whether the object only stands there, and so may sink, rock and lift off."""
        return self.contact == "resting"

    def heights_m(self, points_m: NDArray) -> NDArray:
        """Signed distances from the plane, shape (n,) [m], of points, shape (n, 3) [m]."""
        return (points_m - self.plane_point_m) @ self.up

    def extent_m(self, points_m: NDArray, place_m: NDArray) -> tuple[float, float]:
        """How far points (n, 3) reach along the plane from a place, and above the plane [m]."""
        beside = np.linalg.norm(np.cross(points_m - place_m, self.up), axis=1)
        return float(beside.max()), float(self.heights_m(points_m).max())

    def is_broad(self, points_m: NDArray, faces: NDArray, contact_m: NDArray) -> bool:
        """Whether an object stands loose, on a foot that is broad beside how high it is pressed.

        Its friction decides how far such a foot creeps, and so how far the surface above goes down.

        Parameters
        ----------
        points_m, faces : (n, 3), (m, 3) arrays
            Undeformed surface [m].
        contact_m : (3,) array
            Middle of the contact [m].
        """
        held = points_m[faces[self.holds(points_m)[faces].all(axis=1)]]
        sides = held[:, 1] - held[:, 0], held[:, 2] - held[:, 0]
        area = float(np.linalg.norm(np.cross(*sides), axis=1).sum()) / 2
        height = float(self.heights_m(contact_m[None])[0])
        return self.resting and bool(np.sqrt(area / np.pi) > BROAD * height)

    def holds(self, points_m: NDArray) -> NDArray:
        """Which points, shape (n, 3) [m], lie on the plane, (n,) bool."""
        return np.abs(self.heights_m(points_m)) <= self.tolerance_m


def read_support(block: Mapping) -> Support:
    """Take a ``support`` block of object.yaml or of the configuration.

    Raises
    ------
    ValueError
        As `Support` does.
    """
    return Support(
        np.array(block["plane_point_m"], dtype=float),
        np.array(block["plane_normal"], dtype=float),
        block["tolerance_m"],
        block.get("contact", Support.contact),
    )


def support_nodes(mesh: SolidMesh, support: Support) -> NDArray:
    """Surface nodes on the plane that an object stands on, sorted.

    Raises
    ------
    ValueError
        If fewer than three nodes lie on the plane.
    """
    surface = mesh.surface_nodes()
    held = surface[support.holds(mesh.nodes_m[surface])]
    if len(held) < 3:
        nearest = np.abs(support.heights_m(mesh.nodes_m[surface])).min()
        raise ValueError(
            f"support: expected at least 3 nodes within {support.tolerance_m:g} m of its plane,"
            f" found {len(held)} (nearest {nearest:.3g} m)"
        )
    return held
