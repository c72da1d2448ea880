"""Options of the solids that computations are made on, and declared points that share one table."""

from collections.abc import Mapping, Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from palpate.config.model import Length, Model, Positive, increasing, option

# Of Poisson's ratios: a table that comes near incompressibility serves beyond its last by so much.
NEARLY, BEYOND, LARGEST_RATIO = 0.48, 0.01, 0.4999

TabledRatio = Annotated[float, Field(ge=0, le=0.495)]
# Two points this close to each other's images are images [m].
SAME_M = 1e-4


class IndentationTable(Model):
    """Force and surface of a pressed point by finite elements at finite strain.

    Examples
    --------
    >>> IndentationTable(deepest_m=0.006).deepest_m
    0.006
    """

    poisson_ratios: Annotated[tuple[TabledRatio, ...], increasing] = option(
        (0.0, 0.2, 0.37, 0.49), "of the table's columns", min_length=2
    )
    deepest_m: Length = option(0.009, "where object.yaml has no other; shallower tables are finer")
    step_m: Length = option(0.0015, "between depths; finer at the start")
    edge_m: Length = option(0.0025, "longest edges of elements at the contact")
    growth: Positive = option(0.8, "or this part of the distance from it")
    refine_radius_m: Length = option(0.025, "refined around the contact")


def greatest_ratio(ratios: Sequence[float]) -> float:
    """Greatest Poisson's ratio that a table of some serves for.

    Force and displacement at a given depth are analytic in 1 - 2 nu up to incompressibility, where
    elements that are made to keep their volume would lock: the polynomials go on past the table.
    """
    return min(ratios[-1] + BEYOND, LARGEST_RATIO) if ratios[-1] >= NEARLY else ratios[-1]


def first_images(spec: Mapping) -> dict[str, tuple[str, list[int]]]:
    """For each point the first that it is an image of, and the mirrors that lead from that one.

    Parameters
    ----------
    spec : mapping
        object.yaml: ``points``, ``support`` and, if the object is its own image in planes through
        ``support.plane_point_m``, their normals as ``mirrors``.

    Returns
    -------
    dict
        Of each point (name, numbers of the mirrors); a point that is its own first has none.
    """
    points = {name: np.array(p["position_m"], float) for name, p in spec["points"].items()}
    through = np.array(spec["support"]["plane_point_m"], dtype=float)
    normals = [np.array(n, float) / np.linalg.norm(n) for n in spec.get("mirrors", ())]
    chains: list[list[int]] = [[]]
    for number in range(len(normals)):
        chains += [[*chain, number] for chain in chains]
    straight = {name for name, p in spec["points"].items() if "direction" not in p}
    found = {}
    for name in sorted(points):
        others = [o for o in sorted(points) if o == name or {o, name} <= straight]
        found[name] = next(
            (other, chain)
            for other in others
            for chain in chains
            if np.abs(_image(points[other], chain, normals, through) - points[name]).max() < SAME_M
        )
    return found


def _image(point_m, chain: Sequence[int], normals: Sequence, through_m):
    for number in chain:
        point_m = point_m - 2 * ((point_m - through_m) @ normals[number]) * normals[number]
    return point_m
