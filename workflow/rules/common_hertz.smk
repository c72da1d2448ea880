# What the rules of the Hertz model (Section 5.1) share.
def hertz_outputs():
    """Tables of the Hertz model."""
    return []
