"""What people would write about an object of the lab: object.yaml, and a box's template."""

from collections.abc import Mapping

import numpy as np
import trimesh
import yaml
from numpy.typing import NDArray

from virtual_lab.block import box_surface

BLOCK_EDGE_M = 0.015


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
