"""Closest points of a triangle mesh."""

from palpate.open3d_core import ClosestPoints

__all__ = ["ClosestPoints"]
