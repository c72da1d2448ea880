"""E and nu from force and the surface's motion at once, with intervals."""
