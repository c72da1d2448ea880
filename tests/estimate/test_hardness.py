"""Shore A hardness of a modulus: published pairs, two relations, and readings there and back."""

import numpy as np
import pytest
from palpate.estimate.hardness import HIGHEST, LOWEST, RELATIONS, gent, qi, readings


def test_gent_and_finite_elements_agree_for_soft_rubber():
    """They part with hardness, by a factor of 1.4 at 50."""
    assert gent(50) == pytest.approx(2.46e6, rel=0.01) and qi(50) == pytest.approx(3.43e6, rel=0.01)
    assert gent(30) == pytest.approx(qi(30), rel=0.05)


@pytest.mark.parametrize("name", RELATIONS)
def test_there_and_back(name):
    at = np.linspace(LOWEST, HIGHEST, 15)
    moduli = RELATIONS[name](at)
    assert (np.diff(moduli) > 0).all()
    for reading, modulus in zip(at, moduli, strict=True):
        found = readings(modulus)
        assert found[name] == pytest.approx(reading, abs=0.01)
        assert max(found.values()) - min(found.values()) < 12


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan])
def test_a_modulus_that_is_none(bad):
    with pytest.raises(ValueError, match="modulus_pa: expected a positive modulus"):
        readings(bad)
