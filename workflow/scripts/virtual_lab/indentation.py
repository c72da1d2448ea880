"""Indent an object of the lab with the probe's sphere, over load steps."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from virtual_lab.checks import point_problems
from virtual_lab.contact import ContactProblem, ContactStep
from virtual_lab.load_steps import LoadSteps
from virtual_lab.material import LAWS
from virtual_lab.obstacle import DOWN, Sphere
from virtual_lab.shapes import shape_of
from virtual_lab.solid import Model


def indent_object(
    spec: Mapping, point_m: NDArray, radius_m: float, *, direction: Sequence[float] = DOWN
) -> LoadSteps:
    """Indent an object with a rigid sphere.

    Parameters
    ----------
    spec : mapping
        The object's block of lab.yaml: ``shape``, ``material``, ``contact``.
    point_m : (3,) array
        Point of its surface, object frame [m].
    radius_m : float
        Radius of the sphere [m].
    direction : (3,) sequence, optional
        In which its centre moves along a line through the point, of any length; else straight down.

    Raises
    ------
    ValueError
        If the point is not on the object, the depth exceeds its thickness there, or the direction
        breaks the symmetry that its model takes for granted.
    """
    for line in point_problems(spec["shape"], point_m, spec["contact"]["deepest_m"]):
        raise ValueError(line)
    model = shape_of(spec).model(point_m, spec["contact"])
    if direction is not DOWN:
        direction = tuple(np.asarray(direction) / np.linalg.norm(direction))
        if any(direction[axis] for axis in model.mirrors):
            found = np.round(direction, 3).tolist()
            raise ValueError(f"direction: expected within the planes of symmetry, found {found}")
    problem = contact_problem(spec, model, point_m, radius_m, direction)
    step, deepest = spec["contact"]["step_m"], spec["contact"]["deepest_m"]
    steps = problem.indent(np.linspace(0, deepest, int(np.ceil(deepest / step)) + 1)[1:])
    foremost = problem.obstacles[0].start_m + radius_m * np.array(direction)
    return _load_steps(model, steps, foremost, direction)


def contact_problem(
    spec: Mapping,
    model: Model,
    point_m: NDArray,
    radius_m: float,
    direction: tuple[float, ...] = DOWN,
) -> ContactProblem:
    """Contact of an object and a sphere that comes along a line through a point."""
    material = spec["material"]
    E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
    start = _first_touch(model, point_m, radius_m, direction)
    sphere = Sphere(start, radius_m, spec["contact"]["friction"], direction)
    return ContactProblem(
        model.solid,
        LAWS[material["law"]](E, nu),
        (sphere, *model.supports),
        stiffness_pa=E,
        fixed=model.fixed,
        grade=grade_of(material, model.solid.places_m, start[2] - radius_m),
    )


def grade_of(material: Mapping, places_m: NDArray, top_m: float) -> NDArray | float:
    """How much stiffer than at its top a solid is at places (..., 3) [m], by its material.

    ``gradient`` grows evenly from 0 at the height of the indented point to its value at the table;
    ``skin`` makes a layer below that height stiffer, a quarter of its thickness fading out.
    """
    grade = 1 + material.get("gradient", 0.0) * (1 - places_m[..., 2] / top_m)
    if "skin" in material:
        skin = material["skin"]
        below = (top_m - places_m[..., 2]) / skin["thickness_m"]
        grade = grade + (skin["stiffer"] - 1) * np.clip(4 * (1 - below), 0, 1)
    return grade


def _first_touch(
    model: Model, point_m: NDArray, radius_m: float, direction: Sequence[float]
) -> NDArray:
    """Centre of a sphere that comes along a line through a point and just touches, (3,) [m]."""
    point, up = np.asarray(point_m, dtype=float), np.negative(direction)
    # Where contact is asked for, on the curved elements themselves.
    patch, solid = model.solid.patches["top"], model.solid
    surface = (patch.shapes @ solid.nodes_m[solid.elements[patch.elements]]).reshape(-1, 3)
    offset = surface - point
    away = ((offset - (offset @ up)[:, None] * up) ** 2).sum(axis=1)
    below = away < radius_m**2
    # Points of quadrature end a little beside the touch: the point counts too.
    heights = surface[below] @ up + np.sqrt(radius_m**2 - away[below])
    return point - (point @ up) * up + max(heights.max(), point @ up + radius_m) * up


def _load_steps(
    model: Model, steps: list[ContactStep], point: NDArray, direction: tuple[float, ...]
) -> LoadSteps:
    fields = [model.sample(step.displacement_m) for step in steps]
    share, inclined = 2 ** len(model.mirrors), {}
    if direction is not DOWN:
        back = -np.array([step.forces_n[0] for step in steps])
        back[:, list(model.mirrors)] = 0
        heading = back / -(back @ direction)[:, None]
        inclined = {"direction": np.array(direction), "heading": heading[[0, *range(len(steps))]]}
    return LoadSteps(
        point_m=point,
        depth_m=np.array([0.0, *(step.depth_m for step in steps)]),
        force_n=np.array([0.0, *(share * step.forces_n[0] @ direction for step in steps)]),
        surface_rest_m=model.surface_rest_m,
        surface_faces=model.surface_faces,
        surface_displacement_m=np.stack([np.zeros_like(model.surface_rest_m), *fields]),
        **inclined,
    )
