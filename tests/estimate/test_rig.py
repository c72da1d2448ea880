"""What each error of a rig does to a capture, and whether all captures have the same."""

import numpy as np
import pytest
from made_up_press import RADIUS_M, press_of
from palpate.estimate.direct.options import Rig
from palpate.estimate.direct.rig import rig_errors


@pytest.fixture(scope="module")
def press():
    return press_of(25e3, 0.3, 1)


@pytest.fixture(scope="module")
def errors():
    return {error.source: error for error in rig_errors(Rig(), radius_m=RADIUS_M)}


def test_what_a_force_sensor_reports_wrongly(press, errors):
    """Its zero and drift are each record's own."""
    part = press.time_s / press.time_s[-1]
    for name, common, change in (
        ("scale of the force", True, 0.1 * press.force_n),
        ("zero of the force", False, 0.1),
        ("drift of the force", False, 0.1 * part),
        ("axes of the force sensor", True, 0.1 * press.sideways_n),
    ):
        found = errors[name].changed(press, 0.1)
        assert found.force_n - press.force_n == pytest.approx(change)
        assert errors[name].common is common
        assert np.array_equal(found.depth_m, press.depth_m)


def test_what_is_wrong_about_the_contact_goes_with_the_root_of_its_radius(press, errors):
    radius, curvature = errors["radius of the sphere"], errors["curvature of the template"]
    assert radius.common and curvature.common
    # A sphere that is 1 % larger than was taken pressed as if the force were half a percent less.
    found = radius.changed(press, 0.01 * RADIUS_M)
    assert found.force_n == pytest.approx(0.995 * press.force_n)
    found = curvature.changed(press, 0.01 / RADIUS_M)
    assert found.force_n == pytest.approx(1.005 * press.force_n)


def test_what_is_wrong_about_the_way(press, errors):
    board, given = errors["side of the board"], errors["compliance of the probe"]
    assert board.common and given.common
    found = board.changed(press, 0.02)
    assert found.depth_m == pytest.approx(1.02 * press.depth_m)
    assert found.speed_m_s == pytest.approx(1.02 * press.speed_m_s)
    found = given.changed(press, 1e-4)
    assert found.depth_m == pytest.approx(press.depth_m - 1e-4 * press.force_n[press.frames])
    assert found.force_n is press.force_n


def test_standard_uncertainties_are_the_options(errors):
    rig = Rig()
    assert errors["drift of the force"].std == rig.force_drift_std_n
    assert errors["compliance of the probe"].std == rig.compliance_std_m_n
    assert errors["curvature of the template"].unit == "1/m"
