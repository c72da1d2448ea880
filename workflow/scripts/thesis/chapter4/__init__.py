"""Chapter 4: sensors, probe and what they see."""
