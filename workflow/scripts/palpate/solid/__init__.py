"""The solid: mesh, elastic stiffness, boundary conditions, loads, solver."""
