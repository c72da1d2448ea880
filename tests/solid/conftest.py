"""What the tests of the solid share."""

import pytest
from palpate.solid.mesh import read_solid, solid_mesh
from skfem import MeshTet


@pytest.fixture(scope="session")
def cube():
    mesh = MeshTet().refined(2)
    return solid_mesh(0.1 * mesh.p.T, mesh.t.T)


@pytest.fixture(scope="session")
def block(root):
    return read_solid(root / "config/meshes/foam_block.vtu")
