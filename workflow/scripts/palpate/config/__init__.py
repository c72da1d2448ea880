"""Options and specifications: defaults, bounds, units and messages in one place."""
