"""Mutations of the sample's captures and files, and what the workflow makes of them."""
