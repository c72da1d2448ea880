"""Indentation table of a declared point of an object, or of one that it is a mirror image of."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from palpate.solid.indentation import IndentationModel, mirrored
from palpate.solid.indentation_setup import IndentationOptions
from palpate.solid.indentation_table import indentation_model
from palpate.solid.mesh import SolidMesh
from palpate.solid.mirror import Mirror, require_image
from palpate.solid.options import IndentationTable
from palpate.solid.smooth_surface import SmoothSurface
from palpate.solid.support import Support

# How far a mirrored template may be from itself: scans and their meshes agree to about that [m].
IMAGE_TOLERANCE_M = 0.001
# Steps of a shallow table are finer than configured.
FEWEST_STEPS = 6


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


def image_table(
    model: IndentationModel,
    support: Support,
    surface: tuple[NDArray, NDArray],
    normals: Sequence[Sequence[float]],
) -> IndentationModel:
    """Table of a mirror image of another point, in an object that is its own image.

    Parameters
    ----------
    model : IndentationModel
        Of the other point.
    support : Support
        Its point is in all mirrors.
    surface : (vertices (n, 3) [m], faces (m, 3))
        The object's template.
    normals : sequence of three floats
        Of the mirrors that lead from the other point to this one.

    Raises
    ------
    ValueError
        If the template is not its own image.
    """
    for normal in normals:
        unit = np.array(normal, float) / np.linalg.norm(normal)
        mirror = Mirror(support.plane_point_m, unit)
        require_image(mirror, *surface, tolerance_m=IMAGE_TOLERANCE_M)
        model = mirrored(model, mirror)
    return model
