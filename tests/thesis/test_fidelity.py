"""Measures of the lab's fidelity on made-up data with known answers."""

import numpy as np
import pandas as pd
import pytest
from thesis.accuracy import fidelity


def test_a_planes_residual_is_its_noise():
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-0.4, 0.4, (2, 20_000))
    points = np.column_stack([x, y, 0.9 + 0.1 * x - 0.05 * y + 0.001 * rng.standard_normal(x.size)])
    points[:40, 2] += 0.05
    depth, residual = fidelity.plane_residual(points)
    assert depth == pytest.approx(0.9, abs=2e-3)
    assert residual == pytest.approx(0.001 / np.sqrt(1 + 0.1**2 + 0.05**2), rel=0.03)
    flat = np.column_stack([x, y, np.full(x.size, 0.6)])
    assert fidelity.plane_residual(flat) == pytest.approx((0.6, 0.0))


def test_published_models_at_one_metre():
    assert fidelity.khoshelham_noise_m(1.0) == pytest.approx(1.425e-3)
    assert fidelity.khoshelham_step_m(1.0) == pytest.approx(2.85e-3)
    assert fidelity.nguyen_noise_m(1.0) == pytest.approx(1.884e-3)
    found = fidelity.stereo_noise_m(1.0, disparity_std_px=0.1, product_px_m=790 * 0.12)
    assert found == pytest.approx(0.1 / 94.8)


def test_disparity_noise_is_recovered_from_planes(sensors):
    sensor = sensors["bumblebee"]
    depth = np.array([0.5, 0.7, 0.9])
    residual = fidelity.stereo_noise_m(
        depth, disparity_std_px=0.08, product_px_m=fidelity.product_px_m(sensor)
    )
    planes = pd.DataFrame({"depth_m": depth, "residual_m": residual})
    assert fidelity.disparity_std_px(planes, sensor) == pytest.approx(0.08)
    rows = fidelity.plane_rows(planes, sensor)
    assert [row["value"] for row in rows] == pytest.approx([row["reference_value"] for row in rows])


def test_the_force_lost_while_holding():
    time_s = np.linspace(0, 10, 101)
    force = np.where(time_s < 3, time_s, 3 * (0.8 + 0.2 * np.exp(-(time_s - 3))))
    drop = fidelity.hold_drop(pd.DataFrame({"time_s": time_s, "force_n": force}))
    assert drop == pytest.approx(0.2, abs=0.005)
