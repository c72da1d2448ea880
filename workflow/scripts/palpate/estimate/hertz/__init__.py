"""Reduced modulus from force and depth (Hertz, and laws for thin and deep ones)."""
