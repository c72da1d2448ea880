"""What the numbers of a depth image say."""

import numpy as np
import pytest
from palpate.capture.depth import depth_of
from palpate.yaml_files import load_yaml


def test_kinect_equation(root):
    spec = load_yaml(root / "config/sensors/kinect.yaml")["depth"]
    depth = depth_of(np.array([[690, 2047, 1090]], np.uint16), spec)
    assert depth[0, 0] == pytest.approx(584.6213 * 0.075 / 50)
    assert np.isnan(depth[0, 1:]).all()


@pytest.mark.parametrize(
    ("spec", "metres"),
    [({"encoding": "millimetre"}, 8.5), ({"encoding": "counts", "count_m": 1e-4}, 0.85)],
)
def test_counts_of_depth(spec, metres):
    depth = depth_of(np.array([[8500, 0]], np.uint16), spec)
    assert depth[0, 0] == metres and np.isnan(depth[0, 1])
