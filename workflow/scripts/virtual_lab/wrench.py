"""What the force sensor records: the load on the tip as six gauge voltages, or as a wrench."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.tables import WRENCH_COLUMNS

from virtual_lab.motion import ProbeMotion

GRAVITY_M_S2 = 9.81
# National Instruments PCI-6023E: 12 bits (Section 4.1.3).
ADC_STEPS = 4096
# Micronewtons are far below any noise.
WRENCH_DECIMALS = 6
GAUGES = [f"v{k}" for k in range(6)]


def gauge_record(
    time_s: NDArray,
    force_n: NDArray,
    object_from_force: NDArray,
    probe: Mapping,
    options: Mapping,
    rng: np.random.Generator,
    *,
    measured: Callable[[NDArray], NDArray] = lambda wrench: wrench,
) -> pd.DataFrame:
    """Record a force through the sphere's centre, as six gauge volts or, without gauges, a wrench.

    Parameters
    ----------
    time_s : (n,) array
        Times of the samples [s].
    force_n : (n, 3) array
        Force of the object on the tip, object frame [N].
    object_from_force : (n, 3, 3) array
        Rotation of the probe.
    probe : mapping
        The probe's file.
    options : mapping
        ``force`` block of lab.yaml.
    rng : numpy.random.Generator
        Draws bias and noise.
    measured : callable, optional
        What a sensor in error makes of the wrench (n, 6) on it [N, Nm].

    Returns
    -------
    DataFrame
        ``time_s`` and ``v0`` to ``v5``, or ``fx_n`` to ``tz_nm``.

    Raises
    ------
    ValueError
        If the probe has no gauges and the options no ``wrench``.
    """
    wrench = measured(_wrench_on_sensor(force_n, object_from_force, probe, options))
    table = pd.DataFrame({"time_s": time_s})
    if "gauge" not in probe:
        if "wrench" not in options:
            where = "for a probe without gauges, found none"
            raise ValueError(f"force.wrench: expected its noise {where}")
        errors = options["wrench"]
        noise = np.repeat([errors["noise_n"], errors["noise_nm"]], 3)
        offset = rng.uniform(-1, 1, 6) * np.repeat([errors["offset_n"], errors["offset_nm"]], 3)
        noisy = wrench + offset + noise * rng.standard_normal(wrench.shape)
        table[list(WRENCH_COLUMNS)] = np.round(noisy, WRENCH_DECIMALS)
        return table
    sensitivity = np.linalg.inv(np.array(probe["gauge"]["calibration"]))
    volts = wrench @ sensitivity.T + rng.uniform(-1, 1, 6) * options["bias_v"]
    volts = volts + rng.normal(0, options["noise_v"], volts.shape)
    limit = probe["gauge"]["range_v"]
    step = 2 * limit / ADC_STEPS
    table[GAUGES] = np.clip(np.round(volts / step) * step, -limit, limit - step)
    return table


def _wrench_on_sensor(
    force_n: NDArray, object_from_force: NDArray, probe: Mapping, options: Mapping
) -> NDArray:
    """Wrench on the sensor about its origin, force frame, shape (n, 6) [N, Nm]."""
    up = object_from_force[:, 2, :]
    tip = np.array(probe["force_from_tip"])[:3, 3]
    weight = -options["mass_kg"] * GRAVITY_M_S2 * up
    contact = np.einsum("ni,nij->nj", force_n, object_from_force)
    centre = np.array(options["centre_of_mass_m"])
    torque = np.cross(tip, contact) + np.cross(centre, weight)
    return np.hstack([contact + weight, torque])


def inertial_wrench(path: ProbeMotion, probe: Mapping, options: Mapping) -> NDArray:
    """Wrench of the sensor's payload against its motion, as a point, (n, 6) [N, Nm].

    Force frame, about the sensor's origin.
    """
    centre = np.array(options["centre_of_mass_m"])
    arm = path.object_from_force @ (centre - np.array(probe["force_from_tip"])[:3, 3])
    speed_m_s = np.gradient(path.tip_m + arm, path.time_s, axis=0)
    acceleration_m_s2 = np.gradient(speed_m_s, path.time_s, axis=0)
    pull = np.einsum("ni,nij->nj", -options["mass_kg"] * acceleration_m_s2, path.object_from_force)
    return np.hstack([pull, np.cross(centre, pull)])
