"""What serves the Snakefile and its jobs: configuration, selection, digests, locks, progress."""
