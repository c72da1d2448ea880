"""What the scripts of the simulated block share: its inverse problem from the rule's files."""

from job import naming
from palpate.estimate.simulation import pose_simulation
from palpate.solid.support import read_support
from palpate.surface.simulation import read_steps
from palpate.surface.tracked import load_tracked


def read_problem(steps, tracked, support):
    """Read the loaded nodes and the problem, on tracked data where a file of them is given."""
    read = read_steps(steps)
    surface = load_tracked(tracked) if tracked else None
    with naming(tracked, "tracked"), naming(steps, "support", "contact"):
        return read.triangle, pose_simulation(read, read_support(support), tracked=surface)
