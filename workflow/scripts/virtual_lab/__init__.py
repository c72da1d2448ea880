"""The virtual lab: captures in the very format that people drop in, and their truth."""
