"""Schemas of what people write about objects, sensors, probes and the lab."""
