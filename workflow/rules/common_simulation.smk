# What the rules of the simulated block (Section 3.3) share.
def simulation_outputs():
    """Tables and figures of Chapter 3."""
    return []
