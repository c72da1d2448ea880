"""Corrupted copies of the sample's files, and what Palpate makes of them."""
