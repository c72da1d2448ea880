"""What people would write about an object of the lab: object.yaml, and a box's template."""

from collections.abc import Mapping

import numpy as np
import trimesh
import yaml
from numpy.typing import NDArray

from virtual_lab.block import box_surface
from virtual_lab.rig_errors import seed_of

BLOCK_EDGE_M = 0.015
# Bumps of a template in error: wavelengths of a few of its edges, none at the table.
BUMPS, BUMP_M, BASE_M = 24, (0.08, 0.20), 0.01


def object_text(spec: Mapping, *, name: str) -> str:
    """Text of object.yaml: a template's file where the object is not scanned for one."""
    template = spec["object"]["template"] | {"unit": "m"}
    if "scans" not in template:
        template = {"file": "template.ply"} | template
    description = {"object": name, "provenance": "simulated"} | spec["object"]
    return yaml.safe_dump(description | {"template": template}, sort_keys=False)


def box_template(size_m: NDArray, edge_m: float) -> trimesh.Trimesh:
    """Closed triangulated box on z = 0 with edges of about the given length."""
    low = np.array([-size_m[0] / 2, -size_m[1] / 2, 0.0])
    axes = [
        np.linspace(start, start + side, max(2, round(side / edge_m) + 1))
        for start, side in zip(low, size_m, strict=True)
    ]
    vertices, faces = box_surface(axes)
    return trimesh.Trimesh(vertices, faces, process=False)


def misdeclared(spec: Mapping, errors: Mapping, *, name: str) -> dict:
    """An object's block with points declared beside where they are indented, along x and y.

    ``errors`` has the lab's ``seed`` and the sizes, ``device``; empty: the block as it is.
    """
    size_m = errors.get("device", {}).get("declared_m", 0)
    if not size_m:
        return dict(spec)
    points = {}
    for number, point in spec["object"]["points"].items():
        rng = np.random.default_rng(seed_of(errors, name, "declared", number))
        place = point["position_m"] + size_m * np.append(rng.standard_normal(2), 0)
        points[number] = point | {"position_m": np.round(place, 5).tolist()}
    return dict(spec) | {"object": spec["object"] | {"points": points}}


def bumped(template: trimesh.Trimesh, errors: Mapping, *, name: str) -> None:
    """Give a template smooth bumps along its normals; see `misdeclared`."""
    size_m = errors.get("device", {}).get("template_m", 0)
    if not size_m:
        return
    rng = np.random.default_rng(seed_of(errors, name, "template"))
    heading = rng.standard_normal((3, BUMPS))
    heading /= np.linalg.norm(heading, axis=0)
    angle = template.vertices @ (heading * 2 * np.pi / rng.uniform(*BUMP_M, BUMPS))
    field = np.sin(angle + rng.uniform(0, 2 * np.pi, BUMPS)).sum(axis=1) * np.sqrt(2 / BUMPS)
    high = np.clip(template.vertices[:, 2] / BASE_M, 0, 1)
    template.vertices += size_m * (field * high)[:, None] * template.vertex_normals
