"""What people would write about an object of the lab: object.yaml and a template."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import open3d as o3d
import trimesh
import yaml
from numpy.typing import NDArray

from palpate.lab.block import box_surface
from palpate.lab.shapes import shape_of

BLOCK_EDGE_M = 0.015


def write_object(object_file: Path, template_file: Path, spec: Mapping, *, name: str) -> None:
    """Write object.yaml and the template of an object of the lab."""
    template = spec["object"]["template"] | {"file": template_file.name, "unit": "m"}
    description = {"object": name, "provenance": "simulated"} | spec["object"]
    text = yaml.safe_dump(description | {"template": template}, sort_keys=False)
    object_file.write_text(text, encoding="utf-8")
    template_of(spec).export(template_file)


def template_of(spec: Mapping) -> trimesh.Trimesh:
    """Closed undeformed surface with about the wanted number of vertices."""
    if spec["shape"]["kind"] == "block":
        return box_template(np.array(spec["shape"]["size_m"]), BLOCK_EDGE_M)
    vertices, faces = shape_of(spec).surface()
    return decimated(vertices, faces, spec["object"]["template"]["vertices"])


def box_template(size_m: NDArray, edge_m: float) -> trimesh.Trimesh:
    """Closed triangulated box on z = 0 with edges of about the given length."""
    low = np.array([-size_m[0] / 2, -size_m[1] / 2, 0.0])
    axes = [
        np.linspace(start, start + side, max(2, round(side / edge_m) + 1))
        for start, side in zip(low, size_m, strict=True)
    ]
    vertices, faces = box_surface(axes)
    return trimesh.Trimesh(vertices, faces, process=False)


def decimated(vertices_m: NDArray, faces: NDArray, count: int) -> trimesh.Trimesh:
    """Closed surface of about a number of vertices, by quadric decimation."""
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices_m), o3d.utility.Vector3iVector(faces)
    )
    wanted = 2 * (count - 2)
    if len(faces) > wanted:
        mesh = mesh.simplify_quadric_decimation(wanted)
    return trimesh.Trimesh(np.asarray(mesh.vertices), np.asarray(mesh.triangles), process=False)
