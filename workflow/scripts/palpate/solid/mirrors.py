"""Points that are mirror images of each other in an object that is declared its own image."""

from collections.abc import Mapping, Sequence

import numpy as np

# Two points this close to each other's images are images [m].
SAME_M = 1e-4


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
