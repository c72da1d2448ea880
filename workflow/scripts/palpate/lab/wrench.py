"""What the force sensor records: the load on the tip as six gauge voltages."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

GRAVITY_M_S2 = 9.81
# National Instruments PCI-6023E: 12 bits (Section 4.1.3).
ADC_STEPS = 4096
GAUGES = [f"v{k}" for k in range(6)]


def gauge_record(
    time_s: NDArray,
    normal_force_n: NDArray,
    object_from_force: NDArray,
    probe: Mapping,
    options: Mapping,
    rng: np.random.Generator,
) -> pd.DataFrame:
    """Record a frictionless press: ``time_s`` and six gauge volts.

    The object's pressure on the sphere passes through the sphere's centre and pushes the tip up,
    along z of the object frame.

    Parameters
    ----------
    time_s : (n,) array
        Times of the samples [s].
    normal_force_n : (n,) array
        Force of the object on the tip [N].
    object_from_force : (n, 3, 3) array
        Rotation of the probe.
    probe : mapping
        The probe's file.
    options : mapping
        ``force`` block of lab.yaml.
    rng : numpy.random.Generator
        Draws bias and noise.

    Returns
    -------
    DataFrame
    """
    load = load_on_sensor(normal_force_n, object_from_force, probe, options)
    sensitivity = np.linalg.inv(np.array(probe["gauge"]["calibration"]))
    volts = load @ sensitivity.T + rng.uniform(-1, 1, 6) * options["bias_v"]
    volts = volts + rng.normal(0, options["noise_v"], volts.shape)
    limit = probe["gauge"]["range_v"]
    step = 2 * limit / ADC_STEPS
    table = pd.DataFrame({"time_s": time_s})
    table[GAUGES] = np.clip(np.round(volts / step) * step, -limit, limit - step)
    return table


def load_on_sensor(
    normal_force_n: NDArray, object_from_force: NDArray, probe: Mapping, options: Mapping
) -> NDArray:
    """Wrench on the sensor about its origin, force frame, shape (n, 6) [N, Nm]."""
    up = object_from_force[:, 2, :]
    tip = np.array(probe["force_from_tip"])[:3, 3]
    weight = -options["mass_kg"] * GRAVITY_M_S2 * up
    contact = normal_force_n[:, None] * up
    centre = np.array(options["centre_of_mass_m"])
    torque = np.cross(tip, contact) + np.cross(centre, weight)
    return np.hstack([contact + weight, torque])
