"""Error minimisation over (lambda, mu), the study's way to E and nu."""
