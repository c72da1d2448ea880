"""The study: tables, figures, and accuracy against the truth."""
