"""Reduced models held against full solves."""

import numpy as np
from palpate.solid.solve import factorise


def energy_error(model, lam, mu):
    """Relative error of a reduced model in the energy norm."""
    A1, A2, b1, b2, f = model.system
    K = lam * A1 + mu * A2
    exact = factorise(K)(lam * b1 + mu * b2 + f)
    gap = model.solution(lam, mu) - exact
    return np.sqrt(gap @ (K @ gap) / (exact @ (K @ exact)))


def largest_error(objective, lam, mu):
    """That of the worst of an objective's models."""
    return max(energy_error(model, lam, mu) for model in objective.models.values() if model)
