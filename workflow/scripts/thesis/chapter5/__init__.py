"""Chapter 5: Hertz fits, tracking and error minimisation."""
