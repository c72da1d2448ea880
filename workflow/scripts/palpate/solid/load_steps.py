"""Make the indentation table of a point by finite elements, one load step after another."""

import logging
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from tqdm import tqdm

from palpate.solid.indentation_setup import IndentationOptions, IndentationSetup, indentation_setup
from palpate.solid.indentation_table import (
    IndentationModel,
    ratio_weights,
)
from palpate.solid.indenting import IndentedSolid, State
from palpate.solid.laws import LAW_NAMES, SLIDING
from palpate.solid.mesh import SolidMesh
from palpate.solid.options import IndentationTable
from palpate.solid.smooth_surface import SmoothSurface
from palpate.solid.support import Support

# First depths, as parts of the step: Hertz's contact begins steeply.
BEGINNING = (0.25, 0.5, 1.0, 1.5)
# How often a step of depth is halved before the load steps end.
CUTS = 3
# A start that squeezes an element below this share of its volume is not taken.
LEAST_START = 0.1
# A face's corners and middles in its barycentric coordinates, and triangles between them.
SIX = np.array([[2, 0, 0], [0, 2, 0], [0, 0, 2], [1, 1, 0], [0, 1, 1], [1, 0, 1]]) / 2
QUARTERS = SIX[[[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]]
# Places of one surface that are nearer to each other are one [m].
SAME_PLACE_DECIMALS = 9
POISSON_RATIOS = (0.0, 0.2, 0.37, 0.49)
# Steps of a shallow table are finer than configured.
FEWEST_STEPS = 6


def depth_steps(deepest_m: float, step_m: float) -> NDArray:
    """Depths of a table, from 0 to the deepest, finer at the start [m].

    Raises
    ------
    ValueError
        If the step isn't above 0, or the deepest not above one and a half of it.
    """
    start = np.array([0.0, *BEGINNING]) * step_m
    if not 0 < start[-1] < deepest_m:
        raise ValueError(
            f"deepest_m: expected above {BEGINNING[-1]:g} steps of {step_m:g} m,"
            f" found {deepest_m:g}"
        )
    count = int(np.ceil((deepest_m - start[-1]) / step_m - 1e-9))
    return np.concatenate([start[:-1], np.linspace(start[-1], deepest_m, count + 1)])


def indentation_model(
    mesh: SolidMesh,
    support: Support,
    point_m: NDArray,
    direction: NDArray,
    *,
    radius_m: float,
    deepest_m: float,
    surface: SmoothSurface | None = None,
    laws: tuple[str, ...] = LAW_NAMES,
    poisson_ratios: tuple[float, ...] = POISSON_RATIOS,
    step_m: float = 0.0015,
    options: IndentationOptions | None = None,
) -> IndentationModel:
    """Press a solid with a sphere, for each law, Poisson's ratio and depth.

    Parameters
    ----------
    mesh : SolidMesh
        Four-node elements of the undeformed object.
    support : Support
        Plane that it stands on. Nodes bonded to it don't move; a resting solid is held where it
        presses the plane, and, if its foot is broad, once more slides on it (`laws.SLIDING`).
    point_m, direction : (3,) arrays
        Line of the press [m], into the object.
    radius_m, deepest_m : float
        Of the sphere; how far it goes since it touches [m].
    surface : SmoothSurface, optional
        That the solid's surface is put on after refinement.
    laws, poisson_ratios : tuples, optional
        Names, and increasing values.
    step_m : float, optional
        Between depths [m].
    options : IndentationOptions, optional

    Returns
    -------
    IndentationModel
        Ends at a lesser depth, with a warning, where no equilibrium is found.

    Raises
    ------
    ValueError
        If an argument is out of its range, the point is off the surface, or there is no
        equilibrium at the first depths.

    Examples
    --------
    >>> from palpate import Support, read_solid
    >>> block = read_solid("config/meshes/foam_block.vtu")
    >>> ground = Support(np.zeros(3), np.array([0.0, 0.0, 1.0]), tolerance_m=1e-3)
    >>> point, down = np.array([-0.05, 0.0, 0.0475]), np.array([0.0, 0.0, -1.0])
    >>> press = {"radius_m": 6e-3, "deepest_m": 3e-3, "poisson_ratios": (0.0, 0.49)}
    >>> press |= {"options": IndentationOptions(edge_m=5e-3, growth=1.5)}  # coarse and quick
    >>> table = indentation_model(block, ground, point, down, **press)
    >>> table.laws, table.force_per_modulus_m2.shape[:2]
    (('neo_hookean', 'blatz_ko'), (2, 2))
    """
    if sorted(set(poisson_ratios)) != list(poisson_ratios):
        found = ", ".join(f"{ratio:g}" for ratio in poisson_ratios)
        raise ValueError(f"poisson_ratios: expected increasing numbers, found {found}")
    depths = depth_steps(deepest_m, step_m)
    setup = indentation_setup(
        mesh,
        support,
        point_m,
        direction,
        radius_m=radius_m,
        deepest_m=deepest_m,
        surface=surface,
        options=options or IndentationOptions(),
    )
    if support.is_broad(mesh.nodes_m, mesh.surface_faces(), setup.touch_m):
        laws = (*laws, laws[0] + SLIDING)
    steps_of: dict[tuple[str, int], list[State]] = {}
    count = len(poisson_ratios)
    cases = [(law, number) for law in laws for number in solved_ratios(law == laws[0], count)]
    look = {"unit": "indentation", "disable": None, "leave": False}
    for law, number in tqdm(cases, "indentation table", **look):
        near = [steps_of.get((law, n)) for n in (number - 1, number - 2)]
        # Another law's load steps start from those of the first.
        if law != laws[0]:
            near = [steps_of[laws[0], number], None]
        steps_of[law, number] = steps(setup, law, poisson_ratios[number], depths, near)
    return _model(setup, steps_of, laws, poisson_ratios, depths)


def solved_ratios(first: bool, count: int) -> list[int]:
    """Numbers of the Poisson's ratios that a law is solved at.

    All under the first law; under others the least and the greatest: how they part from the first
    changes slowly between, and what they give is a direction, not a law to choose.
    """
    return list(range(count)) if first else sorted({0, count - 1})


def steps(
    setup: IndentationSetup,
    law: str,
    nu: float,
    depths_m: NDArray,
    near: list[list[State] | None],
) -> list[State]:
    """Equilibria at the depths, as far as there are any.

    Parameters
    ----------
    setup : IndentationSetup
    law, nu : str, float
    depths_m : (k,) array
        From 0 [m].
    near : list
        Up to two of like materials, the nearest first: their steps guess the next.
    """
    pressed, states = setup.pressed(law, nu), [State.at_rest(setup.moved.nodes_m)]
    for k in range(1, len(depths_m)):
        start = _start(setup, states, depths_m, near)
        try:
            state = _step(pressed, states[-1], start, depths_m[k - 1], depths_m[k], CUTS)
        except ValueError as error:
            text = "%s, Poisson's ratio %g: load steps end before %.3g mm (%s)"
            logging.warning(text, law, nu, 1000 * depths_m[k], error)
            break
        states.append(state)
    steps = sum(state.steps for state in states)
    force = states[-1].force_m2 @ setup.direction
    logging.info(
        "%s, Poisson's ratio %g: %d steps, F/E %.4g mm2 at %.3g mm",
        *(law, nu, steps, 1e6 * force, 1000 * depths_m[len(states) - 1]),
    )
    return states


def _step(
    pressed: IndentedSolid, last: State, start: NDArray, from_m: float, to_m: float, cuts: int
) -> State:
    """Equilibrium at a depth, by way of others between where it isn't found at once."""
    if pressed.solid.least_volume(start) < LEAST_START:
        start = last.x_m
    try:
        return pressed.equilibrium(start, to_m, last=last)
    except ValueError:
        if not cuts:
            raise
    half = (from_m + to_m) / 2
    between = _step(pressed, last, last.x_m, from_m, half, cuts - 1)
    return _step(pressed, between, 2 * between.x_m - last.x_m, half, to_m, cuts - 1)


def _start(
    setup: IndentationSetup, states: list[State], depths: NDArray, near: list[list[State] | None]
) -> NDArray:
    """Guess of the next equilibrium: as others went on from there, else straight on."""
    k, x = len(states), states[-1].x_m
    first, second = (other if other and len(other) > k else None for other in near)
    if first is not None:
        onward = first[k].x_m - first[k - 1].x_m
        if second is not None:
            onward = 2 * onward - (second[k].x_m - second[k - 1].x_m)
        return x + onward
    if k == 1:
        return setup.first_start(depths[1])
    part = (depths[k] - depths[k - 1]) / (depths[k - 1] - depths[k - 2])
    return x + part * (x - states[-2].x_m)


def _model(
    setup: IndentationSetup,
    steps_of: dict[tuple[str, int], list[State]],
    laws: tuple[str, ...],
    ratios: tuple[float, ...],
    depths: NDArray,
) -> IndentationModel:
    count = min(map(len, steps_of.values()))
    if count <= len(BEGINNING):
        raise ValueError(
            f"load steps: expected equilibria to {depths[len(BEGINNING)]:g} m, found fewer"
        )
    drawn, triangles = drawn_surface(setup.whole)
    forces = np.zeros((len(laws), len(ratios), count))
    moves = np.zeros((*forces.shape, drawn.shape[0], 3), dtype=np.float32)
    for i, law in enumerate(laws):
        solved = solved_ratios(i == 0, len(ratios))
        for j in solved:
            for k, state in enumerate(steps_of[law, j][:count]):
                forces[i, j, k] = state.force_m2 @ setup.direction
                moves[i, j, k] = drawn @ setup.displacement(state.x_m)
        if len(solved) < len(ratios):
            between = np.array([ratio_weights(np.array(ratios)[solved], nu)[0] for nu in ratios])
            harder = np.log(forces[i, solved, 1:] / forces[0, solved, 1:])
            forces[i, :, 1:] = forces[0, :, 1:] * np.exp(between @ harder)
            moves[i] = moves[0] + np.tensordot(between, moves[i, solved] - moves[0, solved], axes=1)
    return IndentationModel(
        point_m=setup.touch_m,
        direction=setup.direction,
        radius_m=setup.radius_m,
        laws=tuple(laws),
        poisson_ratios=np.array(ratios, dtype=float),
        depth_m=depths[:count],
        force_per_modulus_m2=forces,
        surface_rest_m=drawn @ setup.whole.nodes_m,
        surface_faces=triangles,
        surface_displacement_m=moves,
    )


def drawn_surface(mesh: SolidMesh) -> tuple[sparse.csr_array, NDArray]:
    """Flat triangles, sixteen for each face of a solid, and what its quadratic field is there.

    Displacement is a convex function of the distance from the contact: between the nodes
    themselves, where faces are large, straight lines are 4 % above it.

    Parameters
    ----------
    mesh : SolidMesh
        Of ten-node elements.

    Returns
    -------
    drawn : (n, nodes) sparse array
        From values at the nodes to those at the triangles' corners.
    triangles : (m, 3) int array
        Outward.
    """
    faces, L = mesh.surface_faces(), np.einsum("lab,kbc->klac", QUARTERS, QUARTERS).reshape(-1, 3)
    middles = 4 * L[:, [0, 1, 0]] * L[:, [1, 2, 2]]
    N = np.concatenate([L * (2 * L - 1), middles], axis=1)
    places = (N @ mesh.nodes_m[faces]).reshape(-1, 3).round(SAME_PLACE_DECIMALS)
    _, first, number = np.unique(places, axis=0, return_index=True, return_inverse=True)
    face, at = np.divmod(first, len(N))
    rows = np.repeat(np.arange(len(first)), N.shape[1])
    shape = len(first), len(mesh.nodes_m)
    return sparse.csr_array((N[at].ravel(), (rows, faces[face].ravel())), shape), number.reshape(
        -1, 3
    )


def point_table(
    mesh: SolidMesh,
    support: Support,
    surface: tuple[NDArray, NDArray],
    point: Mapping,
    options: IndentationTable,
    *,
    radius_m: float,
    deepest_m: float | None = None,
) -> IndentationModel:
    """Press an object at a declared point, for each law, Poisson's ratio and depth.

    Parameters
    ----------
    mesh : SolidMesh
        Four-node elements of the undeformed object.
    support : Support
    surface : (vertices (n, 3) [m], faces (m, 3))
        The object's template.
    point : mapping
        ``position_m`` and, where the press is not straight down, ``direction``.
    options : IndentationTable
    radius_m : float
        Of the sphere.
    deepest_m : float, optional
        How far it goes, where that is not what the options say [m].

    Raises
    ------
    ValueError
        As `indentation_model` does.
    """
    deepest = options.deepest_m if deepest_m is None else deepest_m
    # Hertz's contact radius goes with the root of the depth, and so do the elements under it.
    finer = min(1.0, (deepest / options.deepest_m) ** 0.5)
    return indentation_model(
        mesh,
        support,
        np.array(point["position_m"], dtype=float),
        np.array(point.get("direction", -support.plane_normal), dtype=float),
        radius_m=radius_m,
        deepest_m=deepest,
        surface=SmoothSurface(*surface),
        poisson_ratios=options.poisson_ratios,
        step_m=min(options.step_m, deepest / FEWEST_STEPS),
        options=IndentationOptions(
            edge_m=options.edge_m * finer,
            growth=options.growth,
            refine_radius_m=options.refine_radius_m,
        ),
    )
