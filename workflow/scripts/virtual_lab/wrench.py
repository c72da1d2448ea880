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
    felt: Callable[[NDArray], NDArray] | None = None,
) -> pd.DataFrame:
    """Record a frictionless press: ``time_s`` and six gauge volts, or a wrench without gauges.

    The object's pressure on the sphere passes through the sphere's centre.

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
    felt : callable, optional
        What a sensor in error makes of the wrench (n, 6) on it [N, Nm].

    Returns
    -------
    DataFrame

    Raises
    ------
    ValueError
        If the probe has no gauges and the options no ``wrench``.
    """
    load = load_on_sensor(force_n, object_from_force, probe, options)
    if felt is not None:
        load = felt(load)
    if "gauge" not in probe:
        return _wrench_record(time_s, load, options, rng)
    sensitivity = np.linalg.inv(np.array(probe["gauge"]["calibration"]))
    volts = load @ sensitivity.T + rng.uniform(-1, 1, 6) * options["bias_v"]
    volts = volts + rng.normal(0, options["noise_v"], volts.shape)
    limit = probe["gauge"]["range_v"]
    step = 2 * limit / ADC_STEPS
    table = pd.DataFrame({"time_s": time_s})
    table[GAUGES] = np.clip(np.round(volts / step) * step, -limit, limit - step)
    return table


def _wrench_record(
    time_s: NDArray, load: NDArray, options: Mapping, rng: np.random.Generator
) -> pd.DataFrame:
    """Record of a sensor that reports newtons and newton metres, with an offset of its own."""
    if "wrench" not in options:
        raise ValueError("force.wrench: expected its noise for a probe without gauges, found none")
    errors = options["wrench"]
    noise = np.repeat([errors["noise_n"], errors["noise_nm"]], 3)
    offset = rng.uniform(-1, 1, 6) * np.repeat([errors["offset_n"], errors["offset_nm"]], 3)
    noisy = load + offset + noise * rng.standard_normal(load.shape)
    table = pd.DataFrame({"time_s": time_s})
    table[list(WRENCH_COLUMNS)] = np.round(noisy, WRENCH_DECIMALS)
    return table


def load_on_sensor(
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


def inertial_load(path: ProbeMotion, probe: Mapping, options: Mapping) -> NDArray:
    """Wrench of what hangs on the sensor against its motion, as a point, (n, 6) [N, Nm].

    Force frame, about the sensor's origin; see `load_on_sensor`.
    """
    centre = np.array(options["centre_of_mass_m"])
    arm = path.object_from_force @ (centre - np.array(probe["force_from_tip"])[:3, 3])
    speed_m_s = np.gradient(path.tip_m + arm, path.time_s, axis=0)
    acceleration_m_s2 = np.gradient(speed_m_s, path.time_s, axis=0)
    pull = np.einsum("ni,nij->nj", -options["mass_kg"] * acceleration_m_s2, path.object_from_force)
    return np.hstack([pull, np.cross(centre, pull)])
