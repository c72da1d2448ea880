"""All objects beside one another: bars on one axis."""

import re

import numpy as np
import pytest
from palpate.modulus import Modulus
from palpate.report.objects_table import section, ticks

ROW = {"object": "toy_cow", "sensor": "kinect", "capture": "all", "captures": 3}


def row(young_pa, ratio=1.2, **changes):
    """Recommended row of summary.csv whose interval is this wide to either side."""
    young = Modulus.of_pascals(young_pa, young_pa / ratio, young_pa * ratio)
    nu = Modulus(0.38, 0.3, 0.45, "identified", "1")
    return ROW | young.cells("youngs_modulus_pa") | nu.cells("poisson_ratio") | changes


def places(text):
    """Middles of the dots and ends of the intervals [px]."""
    dots = [float(one) for one in re.findall(r'cx="([\d.]+)"', text)]
    ends = re.findall(r'class="interval" d="M([\d.]+) [\d.]+H([\d.]+)', text)
    return np.array(dots), np.array(ends, float)


def test_one_estimate_is_no_table_and_names_stay_text():
    assert section([]) == section([row(20e3)]) == ""
    assert "A&lt;b" in section([row(20e3), row(40e3, object="a<b")])
    assert 'href="a&amp;b/report.html">A&amp;b</a>' in section([], ["a&b"])


def test_bars_share_a_logarithmic_axis():
    dots, ends = places(section([row(1e3), row(10e3), row(100e3)]))
    assert dots[1] - dots[0] == pytest.approx(dots[2] - dots[1], abs=0.1)
    halves = np.log(1.2) / np.log(10) * (dots[1] - dots[0])
    np.testing.assert_allclose(ends, np.add.outer(dots, [-halves, halves]), atol=0.2)


def test_an_object_without_e_has_no_bar_and_one_without_interval_none_about_its_dot():
    bare = {"youngs_modulus_low_pa": np.nan, "youngs_modulus_high_pa": np.nan}
    text = section([ROW, row(20e3) | bare])
    dots, ends = places(text)
    assert len(dots) == 1 and len(ends) == 0
    assert "<svg" not in section([ROW, ROW])


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((30e3, 50e3), [20e3, 50e3]),
        ((20e3, 20e3), [20e3, 50e3]),
        ((6e3, 50.6e3), [5e3, 10e3, 20e3, 50e3, 100e3]),
        ((1.5e3, 2e6), [1e3, 1e4, 1e5, 1e6, 1e7]),
        ((3.0, 2e8), [1.0, 1e3, 1e6, 1e9]),
    ],
)
def test_the_axis_holds_all_between_round_ends(values, expected):
    found = ticks([Modulus(value, None, None, "not judged", "Pa") for value in values])
    np.testing.assert_allclose(found, expected)
    assert ticks([Modulus(30e3, 9e3, 60e3, "bounded", "Pa")]) == [5e3, 10e3, 20e3, 50e3, 100e3]
