"""Filters of the tip's position: the study's, and a smoother that does not lag."""

import numpy as np
from numpy.typing import NDArray

from palpate.vision.options import PoseFilter

# Section 4.2.2: observation model, measurement variance, first covariance, process noise.
H, R, P0, Q = 1.0, 10.0, 0.0, 1.0


def filter_tip(time_s: NDArray, tip_m: NDArray, tip_std_m: NDArray, options: PoseFilter) -> NDArray:
    """Filter a tip's path, each axis for itself.

    Parameters
    ----------
    time_s : (n,) array
        Increasing times of the frames [s], not necessarily even.
    tip_m : (n, 3) array
        Measured positions [m], one at least; rows of NaN are gaps.
    tip_std_m : (n, 3) array
        Standard deviations of the measurements [m].
    options : PoseFilter
        Its method is ``study``, Eq. 4.21 as printed, or ``none``, both of which bridge gaps by
        straight lines, or ``smoother``: a constant-velocity Kalman filter and the smoother of
        Rauch, Tung and Striebel.

    Returns
    -------
    (n, 3) array
        Filtered positions [m].
    """
    if options.method == "smoother":
        std_m = np.hypot(np.nan_to_num(tip_std_m), options.measurement_std_m)
        columns = [
            _smooth(time_s, *column, options.acceleration_std_m_s2)
            for column in zip(tip_m.T, std_m.T, strict=True)
        ]
        return np.column_stack(columns)
    seen = np.isfinite(tip_m[:, 0])
    path = np.column_stack([np.interp(time_s, time_s[seen], column[seen]) for column in tip_m.T])
    return study_filter(path) if options.method == "study" else path


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


def _smooth(
    time_s: NDArray, values: NDArray, std: NDArray, acceleration_std_m_s2: float
) -> NDArray:
    """One coordinate under white acceleration; NaN among the values are gaps."""
    if not (measured := np.isfinite(values)).any():
        raise ValueError("values: expected at least one measurement, found none")
    # Nothing is known before the first measurement: a metre, and a metre a second.
    state, covariance = np.array([values[measured][0], 0.0]), np.eye(2)
    forward = []
    for step, value, deviation in zip(np.diff(time_s, prepend=time_s[0]), values, std, strict=True):
        F = np.array([[1.0, step], [0.0, 1.0]])
        W = np.array([[step**4 / 4, step**3 / 2], [step**3 / 2, step**2]])
        predicted = F @ state, F @ covariance @ F.T + acceleration_std_m_s2**2 * W
        state, covariance = predicted
        if np.isfinite(value):
            gain = covariance[:, 0] / (covariance[0, 0] + deviation**2)
            state = state + gain * (value - state[0])
            covariance = covariance - np.outer(gain, covariance[0])
        forward.append((F, *predicted, state, covariance))
    smoothed = state
    path = [smoothed[0]]
    for (*_, state, covariance), (F, ahead, ahead_covariance, *_) in zip(
        forward[-2::-1], forward[:0:-1], strict=True
    ):
        gain = np.linalg.solve(ahead_covariance.T, (covariance @ F.T).T).T
        smoothed = state + gain @ (smoothed - ahead)
        path.append(smoothed[0])
    return np.array(path[::-1])
