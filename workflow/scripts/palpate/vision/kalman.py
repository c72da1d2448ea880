"""A smoother of the tip's position that does not lag, and the study's filter, which does."""

import numpy as np
from numpy.typing import NDArray

# Section 4.2.2: observation model, measurement variance, first covariance, process noise.
H, R, P0, Q = 1.0, 10.0, 0.0, 1.0
# Of a pose, beyond what it is stated to; and of the probe: at 6 Hz the smoother then hardly does
# more than bridge gaps.
MEASUREMENT_STD_M, ACCELERATION_STD_M_S2 = 0.0001, 0.2


def smooth_tip(
    time_s: NDArray,
    tip_m: NDArray,
    tip_std_m: NDArray,
    *,
    acceleration_std_m_s2: float = ACCELERATION_STD_M_S2,
) -> NDArray:
    """Smooth a tip's path (n, 3) [m], each axis for itself, across gaps.

    A constant-velocity Kalman filter and the smoother of Rauch, Tung and Striebel.

    Parameters
    ----------
    time_s : (n,) array
        Increasing times of the frames [s], not necessarily even.
    tip_m : (n, 3) array
        Measured positions [m], one at least; rows of NaN are gaps.
    tip_std_m : (n, 3) array
        Standard deviations of the measurements [m], finite and above 0.
    acceleration_std_m_s2 : float, optional
        Standard deviation of the tip's acceleration [m/s^2].
    """
    columns = zip(tip_m.T, tip_std_m.T, strict=True)
    return np.column_stack([_smooth(time_s, *column, acceleration_std_m_s2) for column in columns])


def study_filter(values: NDArray) -> NDArray:
    """Scalar Kalman filter of Eq. 4.21 with the study's constants, down each column of (n, k).

    Its model is a point that rests, so a moving tip is followed late: about 2.7 frames on a ramp.
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
