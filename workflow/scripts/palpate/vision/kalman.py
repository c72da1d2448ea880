"""Filters of the tip's position: the study's, and a smoother that does not lag."""

import numpy as np
from numpy.typing import NDArray

# Section 4.2.2: observation model, measurement variance, first covariance, process noise.
H, R, P0, Q = 1.0, 10.0, 0.0, 1.0


def filter_tip(
    time_s: NDArray,
    tip_m: NDArray,
    tip_std_m: NDArray,
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
        Measured positions [m]; rows of NaN are gaps.
    tip_std_m : (n, 3) array
        Standard deviations of the measurements [m].
    method : {"study", "smoother", "none"}
        Eq. 4.21 as printed; `smooth`; or the path as it is. The first and the last bridge gaps by
        straight lines.
    measurement_std_m, acceleration_std_m_s2 : float
        Options of the smoother: error of a measurement beyond what its frame tells [m], and the
        hand's acceleration [m/s^2].

    Returns
    -------
    (n, 3) array
        Filtered positions [m].
    """
    if method == "none":
        return _bridged(time_s, tip_m)
    if method == "study":
        return study_filter(_bridged(time_s, tip_m))
    if method == "smoother":
        std_m = np.hypot(np.nan_to_num(tip_std_m), measurement_std_m)
        columns = [
            smooth(time_s, values, std, acceleration_std_m_s2=acceleration_std_m_s2)
            for values, std in zip(tip_m.T, std_m.T, strict=True)
        ]
        return np.column_stack(columns)
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
    time_s: NDArray, values: NDArray, std: NDArray, *, acceleration_std_m_s2: float
) -> NDArray:
    """Constant-velocity Kalman filter and Rauch-Tung-Striebel smoother of one coordinate.

    Parameters
    ----------
    time_s : (n,) array
        Increasing times [s], not necessarily even.
    values, std : (n,) arrays
        Measured positions and their standard deviations [m]; NaN among the values are gaps.
    acceleration_std_m_s2 : float
        Standard deviation of the white acceleration.

    Returns
    -------
    (n,) array
        Smoothed positions [m].

    Raises
    ------
    ValueError
        If there is no measurement.
    """
    seen = np.isfinite(values)
    if not seen.any():
        raise ValueError("values: expected at least one measurement, found none")
    steps = np.diff(time_s, prepend=time_s[0])
    first = int(np.argmax(seen))
    # Nothing is known before the first measurement: a metre, and a metre a second.
    state, covariance = np.array([values[first], 0.0]), np.eye(2)
    forward = []
    for k, step in enumerate(steps):
        F, W = _motion(step, acceleration_std_m_s2)
        predicted, predicted_covariance = F @ state, F @ covariance @ F.T + W
        state, covariance = predicted, predicted_covariance
        if seen[k]:
            gain = covariance[:, 0] / (covariance[0, 0] + std[k] ** 2)
            state = state + gain * (values[k] - state[0])
            covariance = covariance - np.outer(gain, covariance[0])
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


def _bridged(time_s: NDArray, values: NDArray) -> NDArray:
    """Gaps filled along straight lines, down each column."""
    columns = []
    for column in values.T:
        seen = np.isfinite(column)
        columns.append(np.interp(time_s, np.asarray(time_s)[seen], column[seen]))
    return np.column_stack(columns)
