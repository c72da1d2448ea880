"""Pairs of elastic moduli: values worked by hand, there and back, derivatives."""

import numpy as np
import pytest
from palpate.estimate.minimise.reduced import lame_ratio
from palpate.estimate.minimise.scatter import lame_derivatives
from palpate.solid.laws import (
    engineering_from_lame,
    lame_from_engineering,
    poisson_ratio,
    reduced_modulus,
)


def test_values_by_hand():
    # 24 kPa * 0.2 / (1.2 * 0.6) and 24 kPa / 2.4.
    assert lame_from_engineering(24e3, 0.2) == pytest.approx((24e3 / 3.6, 10e3))
    assert poisson_ratio(3.0, 2.0) == pytest.approx(0.3)
    assert lame_ratio(0.3) == pytest.approx(1.5)
    assert reduced_modulus(21e3, 0.4) == pytest.approx(25e3)


@pytest.mark.parametrize("nu", [0.0, 0.2, 0.49])
def test_there_and_back(nu):
    lam, mu = lame_from_engineering(7e3, nu)
    assert engineering_from_lame(lam, mu) == pytest.approx((7e3, nu))
    assert lame_ratio(nu) == pytest.approx(lam / mu)


@pytest.mark.parametrize("nu", [0.0, 0.2, 0.45])
def test_derivatives_are_differences(nu):
    step = 1e-6
    found = lame_derivatives(7e3, nu)
    by_log_E = np.subtract(
        lame_from_engineering(7e3 * np.exp(step), nu),
        lame_from_engineering(7e3 * np.exp(-step), nu),
    )
    by_nu = np.subtract(
        lame_from_engineering(7e3, nu + step), lame_from_engineering(7e3, nu - step)
    )
    assert found == pytest.approx(np.column_stack([by_log_E, by_nu]) / (2 * step), rel=1e-6)
