# What the rules that draw the Hertz model and the diagrams of Chapter 3 share.
def hertz_figure_outputs():
    """Figures of the Hertz model."""
    return []


def diagram_outputs():
    """Diagrams of Chapter 3."""
    return []
