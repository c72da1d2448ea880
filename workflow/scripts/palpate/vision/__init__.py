"""Seeing: camera, background, marker, force, depth and clouds."""
