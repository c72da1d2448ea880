"""What object.yaml says of the plane that an object stands on."""

import numpy as np
import pytest
from palpate.solid.support import read_support

TILTED = {"plane_point_m": [0, 0, 1], "plane_normal": [0, 3, 4], "tolerance_m": 0.1}


def test_heights_over_a_tilted_plane():
    support = read_support(TILTED)
    points = np.array([[5.0, 0, 1], [0, 0.05, 1.05], [0, 3, 5]])
    assert support.heights_m(points) == pytest.approx([0, 0.07, 5])
    assert support.holds(points).tolist() == [True, True, False]
    assert not support.resting
    assert read_support(TILTED | {"contact": "resting"}).resting


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"plane_normal": [0, 0, 0]}, r"support.plane_normal: expected a direction, found \[0.0"),
        ({"plane_normal": [0, 0, np.inf]}, "support.plane_normal: expected a direction"),
        ({"contact": "glued"}, "support.contact: expected one of bonded, resting, found glued"),
    ],
)
def test_bad_input(change, message):
    with pytest.raises(ValueError, match=message):
        read_support(TILTED | change)
