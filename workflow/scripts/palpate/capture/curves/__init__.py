"""Curves of force against depth, as instruments write them."""
