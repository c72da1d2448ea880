"""MKL's PARDISO without the search: the wrapper left alone walks the whole environment for it."""

import os
import sys
from pathlib import Path

# Where pip puts MKL.
for _library in sorted(Path(sys.prefix, "lib").glob("libmkl_rt.so*"))[:1]:
    os.environ.setdefault("PYPARDISO_MKL_RT", str(_library))

from pypardiso import PyPardisoSolver  # noqa: E402
from pypardiso.pardiso_wrapper import PyPardisoError  # noqa: E402

__all__ = ["SETTINGS", "PyPardisoError", "PyPardisoSolver"]

# First of its parameters: own settings, with METIS's order of unknowns and no refinement of
# solutions (two rounds by default, each as long as a solve; what they leave of a residual, 1e-12,
# is the same without).
SETTINGS = (1, 2)
