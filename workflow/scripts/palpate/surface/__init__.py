"""The surface: template, rigid and non-rigid alignment, transfer to the solid."""
