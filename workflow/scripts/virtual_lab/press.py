"""Press the probe's sphere into an object of the lab over a ladder of depths."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from virtual_lab.contact import ContactProblem, ContactStep
from virtual_lab.ladder import ContactLadder
from virtual_lab.material import LAWS
from virtual_lab.mesh import SolidMesh
from virtual_lab.model import Model
from virtual_lab.obstacle import Sphere
from virtual_lab.shapes import shape_of


def press_object(spec: Mapping, point_m: NDArray, radius_m: float) -> ContactLadder:
    """Press a rigid sphere straight down into an object.

    Parameters
    ----------
    spec : mapping
        The object's block of lab.yaml: ``shape``, ``material``, ``contact``.
    point_m : (3,) array
        Point of its surface, object frame [m].
    radius_m : float
        Radius of the sphere [m].

    Returns
    -------
    ContactLadder

    Raises
    ------
    ValueError
        If the point is not on the object, or the depth exceeds its thickness there.
    """
    model = shape_of(spec).model(point_m, spec["contact"])
    start = first_touch(patch_points(model.solid, "top"), point_m, radius_m)
    problem = contact_problem(spec, model, start, radius_m)
    step, deepest = spec["contact"]["step_m"], spec["contact"]["deepest_m"]
    steps = problem.press(np.linspace(0, deepest, int(np.ceil(deepest / step)) + 1)[1:])
    return _ladder(model, steps, start - [0, 0, radius_m])


def contact_problem(
    spec: Mapping, model: Model, start_m: NDArray, radius_m: float
) -> ContactProblem:
    """Contact of an object and a sphere whose centre starts at a place."""
    material = spec["material"]
    E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
    sphere = Sphere(start_m, radius_m, friction=spec["contact"]["friction"])
    return ContactProblem(
        model.solid,
        LAWS[material["law"]](E, nu),
        (sphere, *model.supports),
        stiffness_pa=E,
        fixed=model.fixed,
    )


def patch_points(solid: SolidMesh, name: str) -> NDArray:
    """Where a patch's contact is asked for, on the curved elements themselves, (n, 3) [m]."""
    patch = solid.patches[name]
    places = patch.shapes @ solid.nodes_m[solid.elements[patch.elements]]
    return places.reshape(-1, 3)


def first_touch(surface_m: NDArray, point_m: NDArray, radius_m: float) -> NDArray:
    """Centre of a sphere that comes straight down above a point and just touches, (3,) [m]."""
    point = np.asarray(point_m, dtype=float)
    away = ((surface_m[:, :2] - point[:2]) ** 2).sum(axis=1)
    below = away < radius_m**2
    # Points of quadrature end a little beside the touch: the point counts too.
    heights = surface_m[below, 2] + np.sqrt(radius_m**2 - away[below])
    return np.array([*point[:2], max(float(heights.max()), point[2] + radius_m)])


def _ladder(model: Model, steps: list[ContactStep], point: NDArray) -> ContactLadder:
    fields = [model.sample(step.displacement_m) for step in steps]
    return ContactLadder(
        point_m=point,
        depth_m=np.array([0.0, *(step.depth_m for step in steps)]),
        force_n=np.array([0.0, *(-model.share * step.forces_n[0, 2] for step in steps)]),
        surface_rest_m=model.surface_rest_m,
        surface_faces=model.surface_faces,
        surface_displacement_m=np.stack([np.zeros_like(model.surface_rest_m), *fields]),
    )
