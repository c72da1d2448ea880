"""Error minimisation: E and nu as the study finds them."""
