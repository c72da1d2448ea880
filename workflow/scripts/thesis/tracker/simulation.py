"""The simulated frames of Section 3.3.2, and the tracker on them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from palpate.npz import read_npz
from palpate.solid.mesh import SolidMesh, doubled_normals, solid_mesh
from palpate.surface.template import Template
from palpate.surface.tracked import Tracked

from thesis.tracker.data_points import Frame
from thesis.tracker.options import Registration
from thesis.tracker.track import track_frames

FIELDS = ("nodes_m", "tetrahedra", "triangle", "force_n", "displacement_m")


@dataclass(frozen=True)
class SimulatedSteps:
    """A solid under a load that grows in steps.

    Attributes
    ----------
    mesh : SolidMesh
        n nodes.
    triangle : (3,) int array
        Loaded nodes.
    force_n, displacement_m : (f, n, 3) arrays
        Nodal loads [N] and displacements [m] in each step.
    """

    mesh: SolidMesh
    triangle: NDArray
    force_n: NDArray
    displacement_m: NDArray


def lattice(cuts: int, *, corners: bool = True) -> NDArray:
    """Barycentric weights of points on a triangle's lattice, shape (k, 3).

    Parameters
    ----------
    cuts : int
        Parts of each edge.
    corners : bool, optional
        Points of the lattice, corners and edges included; or the middles of its upright cells,
        which leave them out.

    Raises
    ------
    ValueError
        If the edges are to be divided into less than one part.
    """
    if cuts < 1:
        raise ValueError(f"cuts: expected at least 1, found {cuts}")
    last, shift = (cuts, 0.0) if corners else (cuts - 1, 1 / 3)
    steps = [(i, j, last - i - j) for i in range(last + 1) for j in range(last + 1 - i)]
    return (np.array(steps) + shift) / cuts


def surface_points(vertices_m: NDArray, faces: NDArray, *, weights: NDArray) -> Frame:
    """Points of every triangle at the same barycentric weights, with the triangle's normal."""
    corners = vertices_m[faces]
    normals = doubled_normals(vertices_m, faces)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = np.einsum("kc,mcd->mkd", weights, corners).reshape(-1, 3)
    return Frame(points, np.repeat(normals, len(weights), axis=0), len(points))


def surface_of(mesh: SolidMesh) -> tuple[Template, NDArray]:
    """Surface of a solid as a template, and the solid's number of each vertex."""
    nodes = mesh.surface_nodes()
    faces = np.searchsorted(nodes, mesh.surface_triangles())
    return Template(mesh.nodes_m[nodes], faces), nodes


def track_steps(
    steps: SimulatedSteps, options: Registration, *, cuts: int, corners: bool = True
) -> Tracked:
    """Track the solid's own surface through the simulated frames, as the study does.

    Every frame is seen from all sides. With corners its points hold the moved vertices among
    others: one finds itself again as long as it moves less than half way to the next point.

    Parameters
    ----------
    steps : SimulatedSteps
    options : Registration
    cuts, corners
        Points of a frame, as of `lattice`.

    Returns
    -------
    Tracked
        In the solid's frame, which is the camera's too; the first frame is the block at rest.
    """
    template, nodes = surface_of(steps.mesh)
    rest, contact = template.vertices_m, steps.mesh.nodes_m[steps.triangle].mean(axis=0)
    moved = np.concatenate([np.zeros((1, *rest.shape)), steps.displacement_m[:, nodes]])
    weights = lattice(cuts, corners=corners)
    frames = (surface_points(rest + step, template.faces, weights=weights) for step in moved)
    vertices, observed, residual = track_frames(template, rest, frames, options)
    return Tracked(rest, template.faces, rest, vertices, observed, np.eye(4), residual, contact, 1)


def read_steps(path: str | Path) -> SimulatedSteps:
    """Read the steps of a simulation.

    Raises
    ------
    ValueError
        If the file is no NPZ of plain arrays, a field is missing, has another shape than the nodes
        ask for, or holds no numbers, there is no step, or `solid_mesh` refuses the elements.
    """
    arrays = read_npz(path, what="an NPZ of plain arrays")
    missing = [name for name in FIELDS if name not in arrays]
    if missing:
        raise ValueError(f"{path}: expected {', '.join(FIELDS)}, found no {missing[0]}")
    try:
        return _checked_steps(*(arrays[name] for name in FIELDS))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _checked_steps(
    nodes_m: NDArray,
    tetrahedra: NDArray,
    triangle: NDArray,
    force_n: NDArray,
    displacement_m: NDArray,
) -> SimulatedSteps:
    count = len(nodes_m) if nodes_m.ndim else 0
    steps = len(force_n) if force_n.ndim else 0
    for name, values, kinds, shape in (
        ("nodes_m", nodes_m, "fiu", (count, 3)),
        ("tetrahedra", tetrahedra, "iu", tetrahedra.shape),
        ("triangle", triangle, "iu", (3,)),
        ("force_n", force_n, "fiu", (steps, count, 3)),
        ("displacement_m", displacement_m, "fiu", (steps, count, 3)),
    ):
        if values.shape != shape:
            raise ValueError(f"{name}: expected shape {shape}, found {values.shape}")
        if values.dtype.kind not in kinds:
            expected = "numbers" if "f" in kinds else "integers"
            raise ValueError(f"{name}: expected {expected}, found {values.dtype}")
        if not np.isfinite(values).all():
            raise ValueError(f"{name}: expected numbers, found NaN or infinity")
    if not steps:
        raise ValueError("force_n: expected at least one step, found none")
    if triangle.min() < 0 or triangle.max() >= count or len(np.unique(triangle)) < 3:
        expected = f"three different nodes of 0 to {count - 1}"
        raise ValueError(f"triangle: expected {expected}, found {triangle.tolist()}")
    return SimulatedSteps(solid_mesh(nodes_m, tetrahedra), triangle, force_n, displacement_m)
