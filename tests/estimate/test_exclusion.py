"""Estimates of one object whose intervals exclude each other, or just do not."""

import pytest
from palpate.estimate.direct.warnings import Estimated, exclusions
from palpate.modulus import LABELS, Modulus

WIDE = {name: Modulus(30e3, 10e3, 90e3, "bounded", "Pa") for name in LABELS}


def of(low, high, whose="all captures by the Kinect", *, joint=True, verdict="identified"):
    E = Modulus((low + (high or 2 * low)) / 2, low, high, verdict, "Pa")
    return Estimated(whose, WIDE | {"youngs_modulus_pa": E}, joint)


def single(low, high, number=1):
    return of(low, high, f"capture {number:02d} by the Bumblebee2", joint=False)


@pytest.mark.parametrize(
    ("other", "warned"),
    [
        (of(26.3e3, 29.4e3), True),
        (of(26.3e3, 30.8e3), False),
        (of(37e3, 40e3), True),
        # Without an upper end, and one that is not to be trusted.
        (of(36e3, None), False),
        (of(37e3, None), True),
        (of(26.3e3, 29.4e3, verdict="not judged"), False),
    ],
)
def test_two_sensors(other, warned):
    lines = exclusions([of(30.7e3, 36.1e3), other])
    assert [len(one) for one in lines] == [warned, warned] and lines[0] == lines[1]


@pytest.mark.parametrize(
    ("excluded", "captures", "joint"), [(1, 5, 0), (2, 5, 1), (4, 36, 0), (5, 36, 1)]
)
def test_single_captures_miss_by_chance_once_in_twenty(excluded, captures, joint):
    singles = [single(24e3, 35e3, k) for k in range(captures - excluded)]
    singles += [single(20e3, 29e3, 90 + k) for k in range(excluded)]
    said, *of_singles = exclusions([of(30e3, 36e3), *singles])
    assert len(said) == joint
    assert [len(one) for one in of_singles] == [0] * (captures - excluded) + [1] * excluded


def test_single_captures_are_not_compared_with_each_other():
    assert exclusions([single(10e3, 11e3), single(20e3, 21e3)]) == [[], []]
