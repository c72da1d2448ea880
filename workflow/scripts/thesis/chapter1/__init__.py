"""Figure 1.1: from a capture to its parameters."""
