"""Estimation: Hertz, and error minimisation with the finite element model."""
