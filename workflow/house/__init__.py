"""What the Snakefile needs to know about the house: configuration, captures, code digests."""
