"""The table that most tests' objects stand on."""

import numpy as np
from palpate.solid.support import Support


def floor(tolerance_m, *, height_m=0.0, contact="bonded"):
    """Support in a plane z = constant."""
    up = np.array([0.0, 0.0, 1.0])
    return Support(height_m * up, up, tolerance_m, contact)
