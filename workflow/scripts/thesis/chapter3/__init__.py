"""Chapter 3: continuum mechanics, and the simulated block."""
