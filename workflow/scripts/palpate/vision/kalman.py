"""Filters of the tip's position: the study's, and a smoother that does not lag."""

import numpy as np
from numpy.typing import NDArray

# Section 4.2.2: observation model, measurement variance, first covariance, process noise.
H, R, P0, Q = 1.0, 10.0, 0.0, 1.0


def filter_tip(
    time_s: NDArray,
    tip_m: NDArray,
    *,
    method: str,
    measurement_std_m: float,
    acceleration_std_m_s2: float,
) -> NDArray:
    """Filter a tip's path, each axis for itself.

    Parameters
    ----------
    time_s : (n,) array
        Times of the frames [s].
    tip_m : (n, 3) array
        Measured positions [m]; rows of NaN are gaps, which only the smoother bridges.
    method : {"study", "smoother", "none"}
        Eq. 4.21 as printed; `smooth`; or the path as it is.
    measurement_std_m, acceleration_std_m_s2 : float
        Options of the smoother [m], [m/s^2].

    Returns
    -------
    (n, 3) array
        Filtered positions [m].
    """
    if method == "none":
        return tip_m.copy()
    if method == "study":
        return study_filter(tip_m)
    if method == "smoother":
        return smooth(
            time_s,
            tip_m,
            measurement_std_m=measurement_std_m,
            acceleration_std_m_s2=acceleration_std_m_s2,
        )
    raise ValueError(f"method: expected study, smoother or none, found {method}")


def study_filter(values: NDArray) -> NDArray:
    """Scalar Kalman filter of Eq. 4.21 with the study's constants, down each column.

    Its model is a point that rests, so a moving tip is followed late: about 2.7 frames on a ramp.

    Parameters
    ----------
    values : (n, k) array
        Measurements.

    Returns
    -------
    (n, k) array
        Estimates; the first is the first measurement.
    """
    estimate, covariance = values[0].astype(float), P0
    path = [estimate]
    for value in values[1:]:
        gain = covariance * H / (H * covariance * H + R)
        estimate = estimate + gain * (value - H * estimate)
        covariance = (1 - gain * H) * covariance + Q
        path.append(estimate)
    return np.array(path)


def smooth(
    time_s: NDArray, values: NDArray, *, measurement_std_m: float, acceleration_std_m_s2: float
) -> NDArray:
    """Constant-velocity Kalman filter and Rauch-Tung-Striebel smoother, down each column.

    Parameters
    ----------
    time_s : (n,) array
        Increasing times [s], not necessarily even.
    values : (n, k) array
        Measured positions [m]; rows with NaN are gaps.
    measurement_std_m, acceleration_std_m_s2 : float
        Standard deviations of a measurement and of the white acceleration.

    Returns
    -------
    (n, k) array
        Smoothed positions [m].
    """
    seen = np.isfinite(values).all(axis=1)
    if not seen.any():
        raise ValueError("values: expected at least one measurement, found none")
    steps = np.diff(time_s, prepend=time_s[0])
    noise = measurement_std_m**2
    state = np.stack([values[np.argmax(seen)], np.zeros(values.shape[1])])
    covariance = np.diag([noise, 1.0])
    forward = []
    for k, step in enumerate(steps):
        F, W = _motion(step, acceleration_std_m_s2)
        predicted, predicted_covariance = F @ state, F @ covariance @ F.T + W
        state, covariance = predicted, predicted_covariance
        if seen[k]:
            gain = covariance[:, :1] / (covariance[0, 0] + noise)
            state = state + gain * (values[k] - state[0])
            covariance = covariance - gain @ covariance[:1]
        forward.append((F, predicted, predicted_covariance, state, covariance))
    return _backward(forward)


def _motion(step: float, acceleration_std: float) -> tuple[NDArray, NDArray]:
    F = np.array([[1.0, step], [0.0, 1.0]])
    W = acceleration_std**2 * np.array([[step**4 / 4, step**3 / 2], [step**3 / 2, step**2]])
    return F, W


def _backward(forward: list[tuple]) -> NDArray:
    smoothed = forward[-1][3]
    path = [smoothed[0]]
    for (_, _, _, state, covariance), (F, predicted, predicted_covariance, _, _) in zip(
        forward[-2::-1], forward[:0:-1], strict=True
    ):
        gain = np.linalg.solve(predicted_covariance.T, (covariance @ F.T).T).T
        smoothed = state + gain @ (smoothed - predicted)
        path.append(smoothed[0])
    return np.array(path[::-1])
