"""One published study, reproduced: its tables, figures and findings."""
