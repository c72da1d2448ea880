"""What is stated of a probe's numbers, in the estimate's deviations and in its budget."""

import numpy as np
import pytest
from made_up_indentation import RADIUS_M
from palpate.estimate.direct.options import Rig
from palpate.estimate.direct.rig import UNSTATED, ProbeUncertainty, rig_errors, turned_gravity
from palpate.vision.force import weight_wrenches
from scipy.spatial.transform import Rotation

UP = np.array([0.0, -0.8, -0.6])


def test_axes_keep_what_a_hanging_weight_does_not_determine():
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


def test_what_a_probes_file_states():
    rows = np.diag([1e-8, 1e-8, 4e-8]).tolist()
    said = {"tip_covariance_m2": rows, "compliance_std_m_n": 1e-6, "load": {"mass_std_kg": 0.001}}
    found = ProbeUncertainty.of(said)
    assert np.array_equal(found.tip_covariance_m2, rows)
    assert (found.compliance_std_m_n, found.mass_std_kg, found.axes_std_rad) == (1e-6, 0.001, None)
    assert ProbeUncertainty.of({}) == UNSTATED
