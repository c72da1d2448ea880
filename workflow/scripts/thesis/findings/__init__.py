"""The study's printed numbers and statements held against ours."""
