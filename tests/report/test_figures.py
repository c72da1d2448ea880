"""Figures of an object: regions, law and relaxation of an estimate."""

import numpy as np
import pytest
from palpate.estimate.direct.result import CaptureFit
from palpate.report.fitted_figures import known
from palpate.report.style import journal

FOUND_JOINT = {
    "youngs_modulus_pa": {"value": 40e3, "low": 36e3, "high": 45e3},
    "youngs_modulus_1s_pa": {"value": 36e3, "low": 33e3, "high": 40e3},
    "poisson_ratio": {"value": 0.3},
    "law": {"force": {"value": 0.2, "std": 0.25}},
    "relaxation": {"times_s": [1.0], "fractions": [0.2]},
    "regions": {
        "force": [[100.0, 0.0], [0.0, 0.0]],
        "surface": [[0.0, 0.0], [0.0, 2500.0]],
        "both": [[100.0, 0.0], [0.0, 2500.0]],
    },
}


def capture_fit():
    depth, away = np.array([0.001, 0.003, 0.002]), np.array([0.02, 0.04, 0.06])
    moved = -0.01 * np.outer(depth, np.ones(3))
    return CaptureFit(
        time_s=np.arange(3.0),
        tip_depth_m=depth,
        frames=np.arange(3),
        force_n=np.array([0.1, 0.5, 0.3]),
        depth_m=depth,
        fitted_depth_m=depth + 1e-4,
        depth_expected_std_m=np.full(3, 5e-5),
        moved_m=moved,
        fitted_moved_m=moved - 2e-5,
        moved_expected_std_m=np.full((3, 3), 1e-5),
        cell_m=np.zeros((3, 3)),
        contact_m=np.zeros(3),
        distance_m=away,
    )


def test_regions_law_and_relaxation():
    """Of 2.45 deviations: 10 % of E are determined by the depth, 0.02 of nu by the surface."""
    with journal():
        plane, law, over_time = known(["kinect"], [FOUND_JOINT], [3.0]).axes
    depth, surface, _ = (c.get_paths()[0].vertices for c in plane.collections[1::2])
    reach = np.sqrt(5.991)
    assert np.ptp(np.log(depth[:, 1])) == pytest.approx(0.2 * reach, rel=0.02)
    assert np.ptp(surface[:, 0]) == pytest.approx(0.04 * reach, rel=0.02)
    peak = law.lines[0].get_xdata()[np.argmax(law.lines[0].get_ydata())]
    assert peak == pytest.approx(0.2, abs=0.02)
    for line in over_time.lines[:2]:
        time, E = line.get_data()
        np.testing.assert_allclose(E, 40 * (1 - 0.2 * (1 - np.exp(-time))))
