"""A solid made ready for an indentation: mesh, what holds it, where the sphere touches first."""

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from palpate.solid.hyperelastic import HyperelasticSolid
from palpate.solid.indenting import IndentedSolid
from palpate.solid.laws import SLIDING, lame_from_engineering, named_law
from palpate.solid.load import contact_pressure
from palpate.solid.mesh import SolidMesh, quadratic, refine_near
from palpate.solid.obstacle import facing_faces, first_touch, surface_points, thickness_m
from palpate.solid.resting import standing_table
from palpate.solid.smooth_surface import SmoothSurface, bent_to, curved_to
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, dofs, elastic_stiffness
from palpate.solid.support import Support, support_nodes

# Of the linear solution that tells how far a press reaches; nearly incompressible reaches farther.
REACH_POISSON_RATIO = 0.45
# Contact radius over the sphere's of that solution.
REACH_CONTACT = 0.7
# Parts of a face's edge for the contact's quadrature; its border runs through the faces.
PARTS = 4
# Of a resting solid: faces this part of the greatest depth above the table may come down to it.
TABLE_REACH = 0.3
# Where it stands: edges as parts of the distance from there, and how far around they are refined.
BASE_GROWTH, BASE_RADIUS_M = 1.0, 0.02
# Of bonded solids, nodes that a linear press moves by less than this part of its depth are held.
STILL_SHARE = 0.0002
# Of the point from the surface along the direction [m].
LARGEST_GAP_M = 0.005


def moving_nodes(
    mesh: SolidMesh,
    support: Support,
    point_m: NDArray,
    direction: NDArray,
    *,
    radius_m: float,
    share: float,
) -> NDArray:
    """Nodes that a press moves, by the linear solution with the support held.

    Parameters
    ----------
    mesh : SolidMesh
        n nodes; either order.
    support : Support
        That the solid is bonded to.
    point_m, direction : (3,) arrays
        Where the surface is pressed [m], and which way, of length 1.
    radius_m : float
        Of the sphere [m].
    share : float
        Nodes that move by less than this part of the indentation are taken as still.

    Returns
    -------
    (n,) bool array
    """
    nu, contact = REACH_POISSON_RATIO, REACH_CONTACT * radius_m
    K1, K2 = elastic_stiffness(mesh)
    held = support_nodes(mesh, support)
    free = np.setdiff1d(np.arange(mesh.nodes_m.size), dofs(held))
    K = combined(K1, K2, *lame_from_engineering(1.0, nu))
    load = contact_pressure(mesh, point_m, direction, direction, contact_radius_m=contact)
    u = np.zeros(load.size)
    u[free] = factorise(K[free][:, free])(load.ravel()[free])
    # Hertz: the depth of force 1 at this contact radius.
    depth = 3 * (1 - nu**2) / (4 * contact)
    return np.linalg.norm(u.reshape(-1, 3), axis=1) > share * depth


@dataclass(frozen=True)
class IndentationOptions:
    """How fine a press is computed.

    Attributes
    ----------
    edge_m, growth, refine_radius_m : float
        Longest edges at the contact, or this part of the distance from it, and how far around the
        point elements are refined [m].
    base_edge_m : float
        Longest edges where a resting solid stands [m].
    """

    edge_m: float = 0.0025
    growth: float = 0.8
    refine_radius_m: float = 0.025
    base_edge_m: float = 0.005


@dataclass(frozen=True)
class IndentationSetup:
    """A solid ready to be pressed along a line.

    Attributes
    ----------
    whole : SolidMesh
        Ten-node elements of all of the solid, n nodes.
    moved : SolidMesh
        Those that move, m nodes.
    nodes : (m,) int array
        Numbers in the whole of the moved nodes.
    free : (m, 3) bool array
        Directions in which these may move.
    touch_m, direction : (3,) arrays
        Place of the sphere's tip when it touches first [m]; its way, of length 1.
    radius_m, deepest_m : float
        Of the sphere [m].
    support : Support
    """

    whole: SolidMesh
    moved: SolidMesh
    nodes: NDArray
    free: NDArray
    touch_m: NDArray
    direction: NDArray
    radius_m: float
    deepest_m: float
    support: Support

    def pressed(self, law: str, nu: float) -> IndentedSolid:
        """Mechanics of a law, on a foot that slides if its name says so, and Poisson's ratio."""
        table, (law, slides, _) = None, law.partition(SLIDING)
        faces = facing_faces(
            self.moved,
            self.touch_m,
            self.direction,
            radius_m=self.radius_m,
            deepest_m=self.deepest_m,
        )
        if self.support.resting:
            reach = TABLE_REACH * self.deepest_m
            table = standing_table(
                self.moved,
                self.support,
                self.touch_m,
                reach_m=reach,
                sticks=not slides,
            )
        return IndentedSolid(
            HyperelasticSolid(self.moved, named_law(law), nu),
            self.free,
            surface_points(self.moved, faces, parts=PARTS),
            touch_m=self.touch_m,
            direction=self.direction,
            radius_m=self.radius_m,
            table=table,
        )

    def first_start(self, depth_m: float) -> NDArray:
        """Guess of the node positions (m, 3) at the first depth [m].

        A resting solid goes down by half of the depth, for both its contacts to bear.
        """
        if not self.support.resting:
            return self.moved.nodes_m
        return self.moved.nodes_m - depth_m / 2 * self.support.up

    def displacement(self, x: NDArray) -> NDArray:
        """Displacement of all nodes (n, 3) at positions of the moved ones [m]."""
        u = np.zeros_like(self.whole.nodes_m)
        u[self.nodes] = x - self.moved.nodes_m
        return u


def indentation_setup(
    mesh: SolidMesh,
    support: Support,
    point_m: NDArray,
    direction: NDArray,
    *,
    radius_m: float,
    deepest_m: float,
    surface: SmoothSurface | None,
    options: IndentationOptions,
) -> IndentationSetup:
    """Refine a solid for a press and find what holds it and where the sphere touches.

    Parameters
    ----------
    As `palpate.solid.load_steps.indentation_model` has them.

    Raises
    ------
    ValueError
        If the direction has no length, the depth is not within the thickness, or the point is off
        the surface.
    """
    length = np.linalg.norm(direction)
    if not 0 < length < np.inf:
        raise ValueError(f"direction: expected one with a length, found {list(direction)}")
    point_m, direction = np.asarray(point_m, dtype=float), np.asarray(direction) / length
    thickness = thickness_m(mesh, point_m, direction)
    if not 0 < deepest_m < thickness:
        raise ValueError(
            f"deepest_m: expected above 0 and below the thickness of {thickness:.3g} m,"
            f" found {deepest_m:g}"
        )
    whole = _fine(mesh, support, point_m, surface, options)
    touch = _touch(whole, point_m, direction, radius_m, deepest_m)
    held = np.zeros(len(whole.nodes_m), dtype=bool)
    elements = np.ones(len(whole.tetrahedra), dtype=bool)
    if not support.resting:
        held[support_nodes(whole, support)] = True
        coarse = quadratic(mesh)
        moving = moving_nodes(
            coarse, support, touch, direction, radius_m=radius_m, share=STILL_SHARE
        )
        nearest = cKDTree(coarse.nodes_m).query(whole.nodes_m)[1]
        elements = moving[nearest][whole.tetrahedra].any(axis=1)
    moved, nodes, free = _cut(whole, elements, held)
    logging.info("%d nodes move in %d directions", len(nodes), free.sum())
    return IndentationSetup(
        whole, moved, nodes, free, touch, direction, radius_m, deepest_m, support
    )


def _fine(
    mesh: SolidMesh,
    support: Support,
    point_m: NDArray,
    surface: SmoothSurface | None,
    options: IndentationOptions,
) -> SolidMesh:
    places = [(point_m, options.refine_radius_m)]
    edges = [{"edge_m": options.edge_m, "growth": options.growth}]
    if support.resting:
        nodes = mesh.nodes_m[mesh.surface_nodes()]
        heights = support.heights_m(nodes)
        base = nodes[heights <= heights.min() + support.tolerance_m].mean(axis=0)
        places.append((base, BASE_RADIUS_M))
        edges.append({"edge_m": options.base_edge_m, "growth": BASE_GROWTH})
    for (middle, radius), edge in zip(places, edges, strict=True):
        mesh = refine_near(mesh, middle, radius_m=radius, **edge)
    if surface is None:
        return quadratic(mesh)

    def smooth_at(points_m: NDArray) -> NDArray:
        near = [np.linalg.norm(points_m - middle, axis=1) < radius for middle, radius in places]
        return np.any(near, axis=0)

    return curved_to(quadratic(bent_to(mesh, surface, smooth_at)), surface, smooth_at)


def _touch(
    whole: SolidMesh,
    point_m: NDArray,
    direction: NDArray,
    radius_m: float,
    deepest_m: float,
) -> NDArray:
    faces = facing_faces(whole, point_m, direction, radius_m=radius_m, deepest_m=deepest_m)
    gap = first_touch(whole.nodes_m, faces, point_m, direction, radius_m=radius_m)
    if abs(gap) > LARGEST_GAP_M:
        raise ValueError(
            f"point_m: expected within {LARGEST_GAP_M:g} m of the surface,"
            f" found {abs(gap):.3g} m along the direction"
        )
    return point_m + gap * direction


def _cut(whole: SolidMesh, elements: NDArray, held: NDArray) -> tuple[SolidMesh, NDArray, NDArray]:
    """The elements that move, the numbers of their nodes, and where these are free."""
    held[whole.tetrahedra[~elements]] = True
    nodes = np.unique(whole.tetrahedra[elements])
    number = np.full(len(whole.nodes_m), -1)
    number[nodes] = np.arange(len(nodes))
    moved = SolidMesh(whole.nodes_m[nodes], number[whole.tetrahedra[elements]])
    return moved, nodes, np.repeat(~held[nodes][:, None], 3, axis=1)
