"""What is stated of a probe's numbers, in the estimate's deviations and in its budget."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_press import OPTIONS, RADIUS_M, press_of
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.options import Rig
from palpate.estimate.direct.probe_uncertainty import UNSTATED, ProbeUncertainty, turned_gravity
from palpate.estimate.direct.rig import rig_errors
from palpate.vision.force import weight_wrenches
from scipy.spatial.transform import Rotation

# Told worst along the board's z.
TIP = ProbeUncertainty(tip_covariance_m2=np.diag([1e-4, 2e-4, 8e-4]) ** 2)
UP = np.array([0.0, -0.8, -0.6])


@pytest.fixture(scope="module")
def press():
    one = press_of(25e3, 0.3, 1)
    return replace(one, turned_m_s2=np.linspace(0, 2, len(one.time_s)))


def line(press, source, known, options=OPTIONS):
    found = estimate_direct([press], options, known, radius_m=RADIUS_M).budget.sources
    (one,) = (one for one in found if one.name == source)
    return one


@pytest.mark.parametrize(
    ("source", "name", "std", "origin"),
    [
        ("compliance of the probe", "compliance_std_m_n", 1e-5, "stated"),
        ("axes of the force sensor", "axes_std_rad", 0.02, "configured, stated"),
        ("mass of the load", "mass_std_kg", 2e-4, "stated"),
    ],
)
def test_contributions_go_with_what_is_stated(press, source, name, std, origin):
    once, thrice = (line(press, source, ProbeUncertainty(**{name: k * std})) for k in (1, 3))
    assert once.std == pytest.approx(std) and once.origin == origin
    # Two fits find the deviations of what they compare, each a little otherwise.
    expected = 3 * once.contributions
    least = 1e-3 * np.abs(expected).max()
    assert thrice.contributions == pytest.approx(expected, rel=0.01, abs=least)
    assert once.contributions[0] > 1e-5


def test_what_is_not_stated_is_the_options(press):
    options = OPTIONS.changed(rig=Rig())
    found = estimate_direct([press], options, radius_m=RADIUS_M).budget.sources
    assert {one.name: one.std for one in found}["compliance of the probe"] == (
        Rig().compliance_std_m_n
    )
    assert "mass of the load" not in {one.name for one in found}
    assert {one.origin for one in found} == {"configured", "observed"}


def test_axes_keep_what_a_hanging_weight_does_not_tell():
    """Of crosstalk between two axes a turn takes up one half: c and d are c - d and c + d."""
    rig = Rig(force_axes_std_rad=0.01)
    (axes,) = (
        one.std
        for one in rig_errors(rig, ProbeUncertainty(axes_std_rad=1e-6), radius_m=RADIUS_M)
        if one.source == "axes of the force sensor"
    )
    cross = np.random.default_rng(0).normal(0, 0.01, (100_000, 2))
    assert axes == pytest.approx((cross.sum(axis=1) / 2).std(), rel=0.01)
    assert ProbeUncertainty(axes_std_rad=0.02).rig(rig).force_axes_std_rad > 0.02


def test_a_tip_that_is_not_stated_is_a_typed_one():
    root = TIP.tip_root_m(0.001)
    assert root @ root.T == pytest.approx(TIP.tip_covariance_m2)
    assert UNSTATED.tip_root_m(0.001) == pytest.approx(5e-4 * np.eye(3))


def test_a_tip_of_the_captures_is_named(press):
    press, known = replace(press, tip_root_m=TIP.tip_root_m(0.001)), replace(TIP, tip="calibrated")
    sources = estimate_direct([press], OPTIONS, known, radius_m=RADIUS_M).budget.sources
    found = {one.name: one.origin for one in sources}
    assert found["tip of the probe"] == "calibrated"
    assert found["zero of the depth"] == found["place of the contact"] == "configured"
    assert found["clocks"] == "configured"


def test_a_mass_matters_by_the_probes_turn():
    """As the weight that the force is read with goes: it is in the zero of the first frame."""
    turns = Rotation.from_rotvec([[0.1, 0.2, 0], [0.3, 0.1, -0.4], [0.1, 0.2, 0]]).as_matrix()
    along = np.array([0.36, -0.48, 0.8])
    sensor = Rotation.from_rotvec([0.5, 0, 1]).as_matrix()
    weight = weight_wrenches(turns @ sensor, UP, {"mass_kg": 1.0, "centre_of_mass_m": [0, 0, 0]})
    more = weight[:, :3] - weight[0, :3]
    on_object = np.einsum("nij,nj->ni", turns @ sensor, more) @ along
    assert turned_gravity(turns, UP, along) == pytest.approx(on_object)
    assert abs(on_object[1]) > 1 and on_object[2] == pytest.approx(0, abs=1e-12)


def test_reading_a_probes_file():
    rows = np.diag([1e-8, 1e-8, 4e-8]).tolist()
    said = {"tip_covariance_m2": rows, "compliance_std_m_n": 1e-6, "load": {"mass_std_kg": 0.001}}
    found = ProbeUncertainty.of(said)
    assert found.compliance_std_m_n == 1e-6 and found.mass_std_kg == 0.001
    assert found.axes_std_rad is None
    assert np.array_equal(found.tip_covariance_m2, rows) and found.tip == "stated"
    assert ProbeUncertainty.of(said | {"tip": "calibrated"}).tip == "calibrated"
    assert ProbeUncertainty.of({}) == UNSTATED
