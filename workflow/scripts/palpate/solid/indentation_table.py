"""Make the look-up of one pressed point by finite elements."""

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.solid.boundary import support_nodes
from palpate.solid.contact_mesh import fine_mesh, moving_nodes, moving_part, nearest_values
from palpate.solid.hyperelastic import HyperelasticSolid
from palpate.solid.indentation import IndentationModel
from palpate.solid.laws import named_law
from palpate.solid.mesh import SolidMesh, quadratic
from palpate.solid.obstacle import surface_points
from palpate.solid.pressing import PressedSolid, State
from palpate.solid.sizing import Support
from palpate.solid.touching import facing_faces, first_touch, thickness_m

CONTACTS = ("bonded", "resting")
# First depths, as parts of the step: Hertz's contact begins steeply.
BEGINNING = (0.25, 0.5, 1.0, 1.5)
# How often a step of depth is halved before the ladder ends.
CUTS = 3
# A start that squeezes an element below this share of its volume is not taken.
LEAST_START = 0.1
# Parts of a face's edge for the contact's quadrature; its border runs through the faces.
PARTS = 4
# Triangles of the face's corners and middles.
QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])


@dataclass(frozen=True)
class TableOptions:
    """How fine a look-up is.

    Attributes
    ----------
    edge_m, growth, refine_radius_m : float
        Longest edges at the contact, or this part of the distance from it, and how far around the
        point elements are refined [m].
    step_m : float
        Between depths [m].
    still_share : float
        Nodes that a linear press moves by less than this part of its depth are held.
    penalty_per_m : float
        Of the contact: pressure per penetration over Young's modulus [1/m].
    largest_gap_m : float
        Of the point from the surface along the direction [m].
    """

    edge_m: float = 0.0022
    growth: float = 0.7
    refine_radius_m: float = 0.03
    step_m: float = 0.001
    still_share: float = 0.002
    penalty_per_m: float = 1e4
    largest_gap_m: float = 0.005


def depth_ladder(deepest_m: float, step_m: float) -> NDArray:
    """Depths of a table, from 0 to the deepest, finer at the start [m]."""
    start = np.array([0.0, *BEGINNING]) * step_m
    count = max(int(np.ceil((deepest_m - start[-1]) / step_m - 1e-9)), 1)
    return np.concatenate([start[:-1], np.linspace(start[-1], deepest_m, count + 1)])


def indentation_model(
    mesh: SolidMesh,
    support: Support,
    point_m: NDArray,
    direction: NDArray,
    *,
    radius_m: float,
    deepest_m: float,
    contact: str = "bonded",
    laws: tuple[str, ...] = ("neo_hookean", "blatz_ko"),
    poisson_ratios: tuple[float, ...] = (0.0, 0.15, 0.3, 0.42, 0.49),
    options: TableOptions | None = None,
) -> IndentationModel:
    """Press a solid with a sphere, for each law, Poisson's ratio and depth.

    Parameters
    ----------
    mesh : SolidMesh
        Four-node elements of the undeformed object.
    support : Support
        Plane that it stands on.
    point_m, direction : (3,) arrays
        Line of the press [m], into the object.
    radius_m, deepest_m : float
        Of the sphere; how far it goes since it touches [m].
    contact : {"bonded", "resting"}, optional
        Bonded nodes of the support don't move; a resting solid is held where it presses the
        plane.
    laws, poisson_ratios : tuples, optional
    options : TableOptions, optional

    Returns
    -------
    IndentationModel
        Ends at a lesser depth, with a warning, where no equilibrium is found.

    Raises
    ------
    ValueError
        If an argument is out of its range, or the point is off the surface.
    """
    options = options or TableOptions()
    direction = _unit(direction)
    press = _Press.make(
        mesh, support, np.asarray(point_m, float), direction, radius_m, deepest_m, contact, options
    )
    depths = depth_ladder(deepest_m, options.step_m)
    ladders = {}
    for law in laws:
        for number, nu in enumerate(poisson_ratios):
            before = [ladders.get((law, n)) for n in (number - 1, number - 2)]
            if number == 0 and ladders:
                before = [ladders[laws[0], number], None]
            ladders[law, number] = press.ladder(law, nu, depths, before)
    return press.model(ladders, laws, poisson_ratios, depths)


def _unit(direction: NDArray) -> NDArray:
    length = np.linalg.norm(direction)
    if not 0 < length < np.inf:
        raise ValueError(f"direction: expected one with a length, found {list(direction)}")
    return np.asarray(direction, dtype=float) / length


@dataclass(frozen=True)
class _Press:
    """A solid ready to be pressed along a line.

    Attributes
    ----------
    whole : SolidMesh
        Ten-node elements of all of the solid.
    moved : SolidMesh
        Those that move.
    nodes : int array
        Numbers in the whole of the moved nodes.
    free : (n, 3) bool array
        Directions in which these may move.
    touch_m : (3,) array
        Place of the sphere's tip when it touches first [m].
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
    contact: str
    options: TableOptions

    @classmethod
    def make(cls, mesh, support, point, direction, radius_m, deepest_m, contact, options):
        if contact not in CONTACTS:
            raise ValueError(f"contact: expected one of {', '.join(CONTACTS)}, found {contact}")
        thickness = thickness_m(mesh, point, direction)
        if not 0 < deepest_m < thickness:
            raise ValueError(
                f"deepest_m: expected above 0 and below the thickness of {thickness:.3g} m,"
                f" found {deepest_m:g}"
            )
        reach = {"radius_m": radius_m}
        whole = fine_mesh(
            mesh,
            point,
            edge_m=options.edge_m,
            growth=options.growth,
            radius_m=options.refine_radius_m,
        )
        faces = facing_faces(whole, point, direction, deepest_m=deepest_m, **reach)
        gap = first_touch(whole.nodes_m, faces, point, direction, **reach)
        if abs(gap) > options.largest_gap_m:
            raise ValueError(
                f"point_m: expected within {options.largest_gap_m:g} m of the surface,"
                f" found {abs(gap):.3g} m along the direction"
            )
        touch = point + gap * direction
        coarse = quadratic(mesh)
        moving = moving_nodes(coarse, support, touch, direction, share=options.still_share, **reach)
        elements, still = moving_part(whole, nearest_values(moving, coarse.nodes_m, whole.nodes_m))
        nodes = np.unique(whole.tetrahedra[elements])
        number = np.full(len(whole.nodes_m), -1)
        number[nodes] = np.arange(len(nodes))
        moved = SolidMesh(whole.nodes_m[nodes], number[whole.tetrahedra[elements]])
        held = still.copy()
        held[
            support_nodes(
                whole,
                plane_point_m=support.point_m,
                plane_normal=support.normal,
                tolerance_m=support.tolerance_m,
            )
        ] = True
        free = np.repeat(~held[nodes][:, None], 3, axis=1)
        logging.info("%d nodes, %d unknowns", len(moved.nodes_m), free.sum())
        return cls(
            whole,
            moved,
            nodes,
            free,
            touch,
            direction,
            radius_m,
            deepest_m,
            support,
            contact,
            options,
        )

    def pressed(self, law: str, nu: float) -> PressedSolid:
        faces = facing_faces(
            self.moved,
            self.touch_m,
            self.direction,
            radius_m=self.radius_m,
            deepest_m=self.deepest_m,
        )
        return PressedSolid(
            HyperelasticSolid(self.moved, named_law(law), nu),
            self.free,
            surface_points(self.moved, faces, parts=PARTS),
            touch_m=self.touch_m,
            direction=self.direction,
            radius_m=self.radius_m,
            penalty_per_m=self.options.penalty_per_m,
        )

    def ladder(self, law, nu, depths, before) -> list[State]:
        """Equilibria at the depths, as far as there are any; others at hand as a start."""
        pressed, states = self.pressed(law, nu), [State(self.moved.nodes_m, np.zeros(3), 0.0, 0)]
        for k, depth in enumerate(depths[1:], start=1):
            start = _start(states, depths, k, before)
            try:
                states.append(self._step(pressed, states[-1], start, depths[k - 1], depth))
            except ValueError as error:
                logging.warning(
                    "%s, Poisson's ratio %g: no equilibrium at a depth of %.4g m (%s)",
                    law,
                    nu,
                    depth,
                    error,
                )
                break
        return states

    def _step(self, pressed, last, start, from_m, to_m, cuts=CUTS) -> State:
        if pressed.solid.least_volume(start) < LEAST_START:
            start = last.x_m
        try:
            return pressed.equilibrium(start, to_m, given_m=last.given_m)
        except ValueError:
            if not cuts:
                raise
        half = (from_m + to_m) / 2
        between = self._step(pressed, last, last.x_m, from_m, half, cuts - 1)
        onward = 2 * between.x_m - last.x_m
        return self._step(pressed, between, onward, half, to_m, cuts - 1)

    def model(self, ladders, laws, ratios, depths) -> IndentationModel:
        count = min(map(len, ladders.values()))
        if count < 2:
            raise ValueError(f"ladder: expected an equilibrium at {depths[1]:g} m, found none")
        faces = self.whole.surface_faces()
        surface, number = np.unique(faces[:, QUARTERS].reshape(-1, 3), return_inverse=True)
        shape = (len(laws), len(ratios), count)
        forces = np.zeros(shape)
        moves = np.zeros((*shape, len(surface), 3), dtype=np.float32)
        for i, law in enumerate(laws):
            for j in range(len(ratios)):
                for k, state in enumerate(ladders[law, j][:count]):
                    forces[i, j, k] = state.force_m2 @ self.direction
                    moves[i, j, k] = self._displacement(state)[surface]
        return IndentationModel(
            point_m=self.touch_m,
            direction=self.direction,
            radius_m=self.radius_m,
            laws=tuple(laws),
            poisson_ratios=np.array(ratios, dtype=float),
            depth_m=depths[:count],
            force_per_modulus_m2=forces,
            surface_rest_m=self.whole.nodes_m[surface],
            surface_faces=number.reshape(-1, 3),
            surface_displacement_m=moves,
        )

    def _displacement(self, state: State) -> NDArray:
        u = np.zeros_like(self.whole.nodes_m)
        u[self.nodes] = state.x_m - self.moved.nodes_m
        return u


def _start(states, depths, k, before) -> NDArray:
    """Guess of an equilibrium: as the ladders before it went on, else straight on."""
    x = states[-1].x_m
    first, second = (ladder if ladder and len(ladder) > k else None for ladder in before)
    if first is not None:
        onward = first[k].x_m - first[k - 1].x_m
        if second is not None:
            onward = 2 * onward - (second[k].x_m - second[k - 1].x_m)
        return x + onward
    if k == 1:
        return x
    part = (depths[k] - depths[k - 1]) / (depths[k - 1] - depths[k - 2])
    return x + part * (x - states[-2].x_m)
