"""The kept mesh of the study's block, pressed."""

import pytest
from palpate.solid.mesh import read_solid
from pressed import pressed


@pytest.fixture(scope="session")
def exact(root):
    """Block with the displacement that a press causes at the true moduli."""
    return pressed(read_solid(root / "config/meshes/foam_block.vtu"), [-0.05, 0, 0.0475])
