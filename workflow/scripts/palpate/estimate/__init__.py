"""Estimation: Hertz, and E and nu straight from clouds and forces."""
