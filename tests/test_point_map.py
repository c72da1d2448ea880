"""Stiffness over an object: whether points differ, and intervals between them."""

from dataclasses import asdict

import numpy as np
import pytest
from palpate import own_part, stiffness_map
from palpate.modulus import Modulus
from palpate.point_map import homogeneity, matern, point_moduli
from scipy.spatial.distance import cdist
from scipy.stats import kstest

E, STD, REACH, RADIUS_M = 25e3, 0.05, 1.96, 0.04
PLACES_M = 0.03 * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (2, 0, 0), (2, 1, 0)])


def modulus(log, std=STD):
    value, low, high = map(float, np.exp([log, log - REACH * std, log + REACH * std]))
    return Modulus(value, low, high, "identified", "Pa")


def on_a_ball(rng, count):
    directions = rng.normal(size=(count, 3))
    return RADIUS_M * directions / np.linalg.norm(directions, axis=1)[:, None]


def test_p_of_equal_points_is_uniform():
    rng, stds = np.random.default_rng(1), np.array([0.02, 0.05, 0.1, 0.04])
    found = [homogeneity(stds * rng.normal(size=4), stds).p_value for _ in range(250)]
    assert kstest(found, "uniform").pvalue > 0.01


def test_how_much_points_differ_has_its_interval():
    rng, true, stds = np.random.default_rng(2), 0.2, np.full(6, STD)
    found = [homogeneity(np.hypot(true, STD) * rng.normal(size=6), stds) for _ in range(150)]
    assert np.median([one.deviation for one in found]) == pytest.approx(true, rel=0.15)
    below = np.mean([one.deviation_high < true for one in found])
    assert below == pytest.approx(0.025, abs=0.03)


def test_points_that_agree_by_chance_do_not_prove_an_even_object():
    agreed = homogeneity(np.full(4, np.log(E)), np.full(4, STD))
    assert agreed.deviation == 0 and agreed.deviation_high > 2 * STD


def test_a_stiff_inclusion_is_found_where_it_is():
    logs = np.log(E) + np.array([0, 0, 0, 0, 0, 0.7])
    found = stiffness_map(PLACES_M, [modulus(log) for log in logs])
    assert found.homogeneity.p_value < 1e-6 and "differ by more than" in str(found)
    value, low, high = found.at(PLACES_M[[0, 5]])
    assert low[1] > high[0] and low[1] < 2 * E < high[1]
    assert value[0] == pytest.approx(E, rel=0.1)


@pytest.mark.parametrize(("deviation", "points"), [(0.0, 4), (0.1, 4), (0.3, 8), (0.6, 8)])
def test_intervals_between_points_hold_made_up_fields(deviation, points):
    rng, inside = np.random.default_rng(3), []
    for _ in range(25):
        places = on_a_ball(rng, points + 20)
        covariance = deviation**2 * matern(cdist(places, places) / 0.03) + 1e-12 * np.eye(
            len(places)
        )
        true = np.log(E) + np.linalg.cholesky(covariance) @ rng.normal(size=len(places))
        # All points share an error that they cannot show.
        seen = true[:points] + STD * rng.normal(size=points) + STD * rng.normal()
        moduli = [modulus(log, np.sqrt(2) * STD) for log in seen]
        _, low, high = stiffness_map(places[:points], moduli, 0.5).at(places[points:])
        inside.append((low < np.exp(true[points:])) & (np.exp(true[points:]) < high))
    assert 0.9 < np.mean(inside)


def test_equal_points_make_an_even_map_that_is_known_least_far_from_them():
    found = stiffness_map(PLACES_M, [modulus(np.log(E))] * 6)
    assert "do not differ beyond their uncertainty (p = 1;" in str(found)
    value, low, high = found.at([PLACES_M[0], PLACES_M[:4].mean(axis=0), (0.3, 0.3, 0.3)])
    assert value == pytest.approx(E)
    half = np.log(high / low) / 2
    assert max(half[:2]) < min(half[2], REACH * STD)


def test_what_points_share_is_in_the_interval_but_not_in_the_test():
    moduli = [modulus(np.log(E) + 0.08 * k) for k in (-1, 0, 1, -1, 0, 1)]
    own, half = (stiffness_map(PLACES_M, moduli, part) for part in (1.0, 0.25))
    assert half.homogeneity.p_value < 0.05 < own.homogeneity.p_value
    _, low, high = half.at(PLACES_M)
    assert (np.log(high / low) / 2 > REACH * STD * np.sqrt(0.75)).all()


@pytest.mark.parametrize(
    ("places", "moduli", "parts", "told"),
    [
        (PLACES_M[:2], 2, 1.0, "moduli: expected 3 points or more, found 2"),
        (PLACES_M[:4], 3, 1.0, r"places_m: expected \(3, 3\) finite, found \(4, 3\)"),
        (PLACES_M[[1, 1, 1]], 3, 1.0, "places_m: expected places apart, found one for all"),
        (PLACES_M[:3], 3, [1.0, 0.0, 1.0], "own_parts: expected above 0 and at most 1"),
    ],
)
def test_what_makes_no_map(places, moduli, parts, told):
    with pytest.raises(ValueError, match=told):
        stiffness_map(places, [modulus(np.log(E))] * moduli, parts)
    open_ended = Modulus(E, 0.9 * E, None, "bounded", "Pa")
    with pytest.raises(ValueError, match="moduli: expected values within intervals, found 25.0"):
        stiffness_map(PLACES_M[:3], [open_ended] * 3)


SOURCES = {"noise of the depth": 3, "indentation table: force": 4, "scale of the force": 12}


def single(apart=0.0, verdict="identified"):
    part = "contribution_log_effective_reduced_modulus"
    budget = [{"source": name, part: size} for name, size in SOURCES.items()]
    found = asdict(modulus(np.log(E) + apart, 0.13)) | {"verdict": verdict}
    return {"effective_reduced_modulus_pa": found, "budget": budget}


def test_captures_of_a_point_share_its_errors():
    assert own_part(single()["budget"]) == pytest.approx(25 / 169)
    captures = [{"point": name} for name in ("1", "2", "2", "2", "2", "3")]
    singles = [single() for _ in captures]
    singles[-1] = single(verdict="not judged")
    found = point_moduli(captures, singles)
    assert list(found) == ["1", "2"]
    one, (four, part) = found["1"][0], found["2"]
    # Noise is a half of one capture's; what the point's captures share stays.
    std = np.sqrt(0.03**2 / 4 + 0.04**2 + 0.12**2)
    assert np.log(four.high / four.low) == pytest.approx(2 * REACH * std, rel=1e-3)
    assert part == pytest.approx(1 - 0.12**2 / std**2) and four.value == pytest.approx(one.value)
    # Narrow as the whole may be, a capture that warns is not judged better by others beside it.
    singles[2] = single(verdict="bounded")
    assert point_moduli(captures, singles)["2"][0].verdict == "bounded"
    # Captures that are farther apart than their noise are known no better than they are apart.
    singles[1:5] = [single(apart) for apart in (-0.2, -0.2, 0.2, 0.2)]
    wider = point_moduli(captures, singles)["2"][0]
    std = np.sqrt(0.2**2 / 3 + 0.04**2 + 0.12**2)
    assert np.log(wider.high / wider.low) == pytest.approx(2 * REACH * std, rel=1e-3)
