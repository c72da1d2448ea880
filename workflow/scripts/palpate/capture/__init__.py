"""The capture format: read, check, write."""
