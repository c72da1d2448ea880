"""What the tests of the solid share."""

import pytest
from palpate.solid.mesh import read_solid, solid_mesh
from skfem import MeshTet


def refined_cube(refinements):
    """Of 100 mm."""
    mesh = MeshTet().refined(refinements)
    return solid_mesh(0.1 * mesh.p.T, mesh.t.T)


@pytest.fixture(scope="session")
def coarse():
    return refined_cube(1)


@pytest.fixture(scope="session")
def cube():
    return refined_cube(2)


@pytest.fixture(scope="session")
def fine():
    return refined_cube(3)


@pytest.fixture(scope="session")
def block(root):
    return read_solid(root / "config/meshes/foam_block.vtu")
