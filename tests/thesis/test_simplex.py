"""Figure 3.8: moves of the simplex."""

from itertools import pairwise

import numpy as np
import pytest
from thesis.chapter3 import simplex


def cost(x):
    return float((x[0] - 3) ** 2 + 2 * (x[1] - 2) ** 2 + (x[0] - 3) * (x[1] - 2))


def test_moves_of_a_known_triangle():
    found = simplex.moves([[0, 0], [2, 0], [1, 2]])
    wanted = {"m": (1, 0), "r": (1, -2), "e": (1, -4), "c1": (1, 1), "c2": (1, -1)}
    for name, place in (wanted | {"s_g": (1, 0), "s_w": (0.5, 1)}).items():
        assert found[name] == pytest.approx(place)
    with pytest.raises(ValueError, match=r"simplex: expected shape \(3, 2\), found \(2, 2\)"):
        simplex.moves(np.zeros((2, 2)))


def test_no_step_gets_worse():
    path = simplex.simplexes(cost, np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), 12)
    for before, after in pairwise(path):
        values = [cost(x) for x in before]
        assert values == sorted(values)
        assert min(cost(x) for x in after) <= values[0]


def test_error_field_scales_with_the_shear_modulus():
    measured = np.array([[1.0, 0, 0], [0, 2.0, 0]])
    field = simplex.error_field(
        lambda ratio: measured * ratio, measured, np.array([1.0, 2.0]), np.array([1.0, 2.0])
    )
    assert field.error_m == pytest.approx(np.array([[0, 0.75], [1.5, 0]]))
    assert field.lam_pa == pytest.approx(np.array([[1, 2], [2, 4]]))
