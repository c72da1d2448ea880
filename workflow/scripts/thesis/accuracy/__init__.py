"""How right results are, against the virtual lab's truth."""
