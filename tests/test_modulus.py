"""A modulus as it is told, and the words of its verdict."""

import pandas as pd
import pytest
from palpate.modulus import VERDICTS, Modulus, verdict_of_nu, verdicts_in

MODULUS = Modulus(24130.0, 23000.0, 25500.0, "identified", "Pa")


@pytest.mark.parametrize(
    ("modulus", "text"),
    [
        (MODULUS, "24.1 kPa (23.0 to 25.5), identified"),
        (Modulus(2.5e6, 1e5, 3e6, "bounded", "Pa"), "2.5 MPa (0.1 to 3.0), bounded"),
        (Modulus(0.312, 0.0, 0.49, "not identified", "1"), "0.31 (0.00 to 0.49), not identified"),
        (Modulus(850.0, None, None, "not judged", "Pa"), "850.0 Pa, not judged"),
    ],
)
def test_a_modulus_is_told_in_its_own_unit(modulus, text):
    assert str(modulus) == text


@pytest.mark.parametrize("name", ["youngs_modulus_pa", "poisson_ratio"])
def test_a_table_gives_back_what_it_was_given(name):
    unit = "Pa" if name.endswith("_pa") else "1"
    one = Modulus(0.4, 0.3, 0.5, "bounded", unit)
    table = pd.DataFrame([one.cells(name), {}])
    assert Modulus.of_row(table.iloc[0], name) == one
    assert Modulus.of_row(table.iloc[1], name) is None


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (0.0051, 0.2, "identified"),
        (0.005, 0.2, "bounded"),
        (0.3, 0.4949, "identified"),
        (0.3, 0.495, "bounded"),
        (0.25, 0.45, "identified"),
        (0.25, 0.4501, "bounded"),
        (0.005, 0.4949, "bounded"),
        (0.0051, 0.495, "bounded"),
        (0.005, 0.495, "not identified"),
    ],
)
def test_verdicts_of_poissons_ratio_at_their_limits(low, high, verdict):
    assert verdict_of_nu(low, high, (0.0, 0.5)) == verdict


def test_a_modulus_is_identified_up_to_a_factor():
    highs = (15.0, 15.001)
    found = [Modulus.of_pascals(12.0, 10.0, high).verdict for high in highs]
    assert found == ["identified", "bounded"]


def test_what_a_table_says_is_explained_the_best_first(root):
    rows = [Modulus(1.0, 0.5, 2.0, v, "Pa").cells("youngs_modulus_pa") for v in VERDICTS]
    assert verdicts_in(pd.DataFrame(rows[::-1])) == list(VERDICTS)
    docs = (root / "docs/start_here.md").read_text()
    assert [verdict for verdict in VERDICTS if f"**{verdict}**: " not in docs] == []
