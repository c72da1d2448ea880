"""Figure 1.1: the way from a capture to its parameters."""
