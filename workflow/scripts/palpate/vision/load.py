"""What hangs on the force sensor and how the sensor sits, from poses at rest in the air."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from palpate.units import GRAVITY_M_S2, MILLINEWTONS
from palpate.vision.force import STRONGEST_HAND_N

FEWEST_POSES = 6
# Root mean square by which the vertical must turn about two axes of the handle; one that is held
# upright, upside down and level to four sides has 35.
LEAST_TURN_DEG = 10.0
# Of the weight: what poses and wrenches of one handle may leave; wrong signs leave half and more.
LARGEST_MISFIT = 0.2
# Readings of a sensor without a load are off by less; where they are not, a weight is misread.
UNEXPLAINED_N = 0.03
SURE = 5.0
# How seldom a pose that nothing touches is taken for a touched one, and how many of many may be
# touched. Of fewer poses than nine whose noise is not known the one that tells most would be.
FEWEST_TELL_NOISE = 9
UNLIKELY, MOST_LEFT_OUT = 1e-6, 0.1
ROUNDED = 1e-6
# Student's variance is told from so many degrees of freedom on.
LEAST_FREEDOM = 3.0
# Of the weight's changes, from which a channel's scale is judged.
LEAST_SHARE = 1e-3
# No handle is so long; torques in another unit have it farther.
FARTHEST_CENTRE_M = 0.5
# Where the unknowns stand: weight, turn, zero of the forces; centre of mass, zero of the torques.
WEIGHT, TURN, ZERO_N = 0, slice(1, 4), slice(4, 7)
CENTRE, ZERO_NM = slice(7, 10), slice(10, 13)
UNKNOWNS = 13


@dataclass(frozen=True)
class Load:
    """A load on the sensor, and how well the poses tell it.

    Attributes
    ----------
    mass_kg : float
    centre_of_mass_m : (3,) array
        In the force sensor's frame.
    bias : (6,) array
        What the sensor says without a load [N, Nm].
    marker_from_force : (3, 3) array
        Rotation of the sensor in the board's frame.
    covariance : (13, 13) array
        Of mass [kg], rotation vector in the force frame [rad], zero of the forces [N], centre of
        mass [m], and zero of the torques [Nm].
    residuals : (n, 6) array
        Of each pose [N, Nm].
    kept : (n,) bool array
        Poses that count.
    weight_n : (n, 3) array
        Of the load at each pose, force frame [N].
    """

    mass_kg: float
    centre_of_mass_m: NDArray
    bias: NDArray
    marker_from_force: NDArray
    covariance: NDArray
    residuals: NDArray
    kept: NDArray
    weight_n: NDArray

    @property
    def gains(self) -> tuple[NDArray, NDArray]:
        """What each force channel reads of the weight's changes, and its deviation, (3,) each."""
        off = self.residuals[self.kept, :3]
        weight = self.weight_n[self.kept] - self.weight_n[self.kept].mean(axis=0)
        square = (weight**2).sum(axis=0)
        # A channel that the weight hardly changes says nothing of its own scale.
        square = np.where(square > LEAST_SHARE * square.sum(), square, np.inf)
        gains = 1 + (weight * off).sum(axis=0) / square
        left = off - off.mean(axis=0) - (gains - 1) * weight
        return gains, np.sqrt((left**2).sum(axis=0) / (len(off) - 2) / square)

    @property
    def std(self) -> NDArray:
        """Standard deviations of the thirteen unknowns, as ``covariance`` has them."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def turn_std_deg(self) -> float:
        """Standard deviation of the sensor's rotation, about the axis that is told least."""
        return float(np.degrees(np.sqrt(np.linalg.eigvalsh(self.covariance[TURN, TURN])[-1])))


@dataclass(frozen=True)
class _Fit:
    """Least squares of poses: unknowns, whitened derivatives, residuals, and by what they weigh.

    The unknown turn comes after ``force_from_marker``.
    """

    x: NDArray
    jacobian: NDArray
    off: NDArray
    scale: NDArray
    force_from_marker: NDArray


def find_load(
    camera_from_marker: NDArray,
    wrench: NDArray,
    up: NDArray,
    noise: NDArray | None = None,
    names: Sequence[str] = (),
) -> Load:
    """Weight, centre of mass, zeros and rotation that explain wrenches at rest.

    A pose is left out whose wrench the others do not explain.

    Parameters
    ----------
    camera_from_marker : (n, 4, 4) or (n, 3, 3) array
        Poses of the board.
    wrench : (n, 6) array
        Mean reading at each pose, force frame [N, Nm].
    up : (3,) array
        Upward direction, camera frame.
    noise : (6,) array, optional
        Standard deviation of each channel's mean; that of the residuals, of forces and of torques
        each, where it is not known. Deviations are never less than the residuals say.
    names : sequence of str, optional
        What errors call the poses; else their numbers, from 1.

    Raises
    ------
    ValueError
        If there are less than six poses, they are alike, the sensor feels no weight, none that
        turns as the board does, or one that hangs farther away than a handle is long, or wrenches
        of too many poses are others.
    """
    if len(wrench) < FEWEST_POSES:
        raise ValueError(f"poses: expected at least {FEWEST_POSES}, found {len(wrench)}")
    down = -camera_from_marker[:, :3, :3].transpose(0, 2, 1) @ (up / np.linalg.norm(up))
    kept = np.ones(len(wrench), dtype=bool)
    fewest = max(FEWEST_POSES, len(wrench) - max(1, int(MOST_LEFT_OUT * len(wrench))))
    known = noise is not None
    while True:
        fit = _fitted(down[kept], wrench[kept], noise)
        worst = _outlier(fit, known=known)
        if worst is None or kept.sum() == fewest:
            break
        kept[np.flatnonzero(kept)[worst]] = False
    _check_weight(fit.x[WEIGHT], fit.off, wrench)
    _check_centre(fit.x[CENTRE])
    if worst is not None:
        place = int(np.flatnonzero(kept)[worst])
        _refuse_pose(names[place] if names else f"pose {place + 1}", fit.off[worst])
    covariance = _covariance(fit, known=known)
    per_newton = np.ones(UNKNOWNS)
    per_newton[WEIGHT] = 1 / GRAVITY_M_S2
    turn = Rotation.from_rotvec(fit.x[TURN]).as_matrix() @ fit.force_from_marker
    return Load(
        mass_kg=float(fit.x[WEIGHT] / GRAVITY_M_S2),
        centre_of_mass_m=fit.x[CENTRE],
        bias=np.append(fit.x[ZERO_N], fit.x[ZERO_NM]),
        marker_from_force=turn.T,
        covariance=covariance * np.outer(per_newton, per_newton),
        residuals=_residuals(fit.x, down, fit.force_from_marker, wrench),
        kept=kept,
        weight_n=fit.x[WEIGHT] * down @ turn.T,
    )


def _fitted(down: NDArray, wrench: NDArray, noise: NDArray | None) -> _Fit:
    _check_turn(down)
    weight_n, force_from_marker, zero_n = _similar(down, wrench[:, :3])
    start = np.zeros(UNKNOWNS)
    start[WEIGHT], start[ZERO_N] = weight_n, zero_n
    start[CENTRE], start[ZERO_NM] = _levers(weight_n * down @ force_from_marker.T, wrench[:, 3:])
    scale = _noise(_residuals(start, down, force_from_marker, wrench)) if noise is None else noise

    def whitened(x: NDArray) -> NDArray:
        return (_residuals(x, down, force_from_marker, wrench) / scale).ravel()

    fit = least_squares(whitened, start, x_scale="jac", method="lm")
    off = _residuals(fit.x, down, force_from_marker, wrench)
    return _Fit(fit.x, fit.jac.reshape(-1, 6, UNKNOWNS), off, scale, force_from_marker)


def _outlier(fit: _Fit, *, known: bool) -> int | None:
    """The pose whose forces or torques are surely others than the other poses say, if one is.

    By how much less is left without it, against what is left of the others, or against the noise
    where that is known and more: Fisher's distribution.
    """
    if not known and len(fit.off) < FEWEST_TELL_NOISE:
        return None
    jacobian, off = fit.jacobian, fit.off / fit.scale
    inverse = np.linalg.inv(np.einsum("nci,ncj->ij", jacobian, jacobian))
    sure = np.ones(len(off))
    for part in (slice(0, 3), slice(3, 6)):
        own = jacobian[:, part] @ inverse @ jacobian[:, part].transpose(0, 2, 1)
        free = 3 * len(off) - np.trace(own, axis1=1, axis2=2).sum() - 3
        # A pose that alone tells an unknown has nothing left.
        more = np.linalg.solve((1 + ROUNDED) * np.eye(3) - own, off[:, part, None])[..., 0]
        square = (off[:, part] * more).sum(axis=1)
        # Readings without noise leave rounding alone.
        rest = ((off[:, part] ** 2).sum() - square) / free
        rest = np.maximum(rest, 1 if known else np.finfo(float).tiny ** 0.5)
        sure = np.minimum(sure, stats.f.sf(square / 3 / rest, 3, free))
    worst = int(np.argmin(sure))
    return worst if sure[worst] < UNLIKELY / (2 * len(off)) else None


def _similar(down: NDArray, force: NDArray) -> tuple[float, NDArray, NDArray]:
    """Factor, rotation and shift that bring directions to forces (S. Umeyama, 1991, Eq. 40-42)."""
    middle, mean = down.mean(axis=0), force.mean(axis=0)
    left, sizes, right = np.linalg.svd((force - mean).T @ (down - middle))
    signs = np.array([1, 1, np.linalg.det(left @ right)])
    turn = left * signs @ right
    factor = float(sizes @ signs / ((down - middle) ** 2).sum())
    return factor, turn, mean - factor * turn @ middle


def _levers(weight: NDArray, torque: NDArray) -> tuple[NDArray, NDArray]:
    """Centre of mass and zero of torque = centre x weight + zero, linear least squares."""
    x, y, z = weight.T
    null = np.zeros_like(x)
    by_centre = np.array([[null, z, -y], [-z, null, x], [y, -x, null]]).transpose(2, 0, 1)
    rows = np.concatenate([by_centre, np.broadcast_to(np.eye(3), by_centre.shape)], axis=2)
    return np.split(np.linalg.lstsq(rows.reshape(-1, 6), torque.ravel(), rcond=None)[0], 2)


def _residuals(x: NDArray, down: NDArray, force_from_marker: NDArray, wrench: NDArray) -> NDArray:
    """Reading less that of a load, (n, 6) [N, Nm]; the turn comes after the given rotation."""
    turn = Rotation.from_rotvec(x[TURN]).as_matrix() @ force_from_marker
    weight = x[WEIGHT] * down @ turn.T
    load = np.hstack([weight + x[ZERO_N], np.cross(x[CENTRE], weight) + x[ZERO_NM]])
    return wrench - load


def _noise(residuals: NDArray) -> NDArray:
    """Standard deviation of forces and of torques, (6,), less the unknowns that each tells."""
    count = len(residuals) * 3
    square = (residuals**2).reshape(-1, 2, 3).sum(axis=(0, 2)) / [count - 7, count - 6]
    # Readings without noise leave rounding alone.
    return np.repeat(np.maximum(np.sqrt(square), np.finfo(float).tiny ** 0.25), 3)


def _covariance(fit: _Fit, *, known: bool) -> NDArray:
    """Of the unknowns, where each channel is off by what its residuals say.

    Beyond what is known of the channels' noise there is what the poses are off by, which is across
    the weight. A channel's residuals are less by what the unknowns took of them, and few residuals
    tell a variance badly: an error over its deviation is Student's, with the degrees of freedom of
    B. L. Welch (1947), and has the variance of that.
    """
    inverse = np.linalg.inv(np.einsum("nci,ncj->ij", fit.jacobian, fit.jacobian))
    parts = fit.jacobian @ inverse
    free = len(fit.off) - np.einsum("nci,nci->c", parts, fit.jacobian)
    variance = ((fit.off / fit.scale) ** 2).sum(axis=0) / free
    variance = np.maximum(variance, 1) if known else variance
    guessed = 1 - 1 / variance if known else np.ones(6)
    by_channel = variance[:, None] * (parts**2).sum(axis=0)
    unsure = ((guessed[:, None] * by_channel) ** 2 / free[:, None]).sum(axis=0)
    freedom = by_channel.sum(axis=0) ** 2 / np.maximum(unsure, np.finfo(float).tiny)
    freedom = np.maximum(freedom, LEAST_FREEDOM)
    wider = np.sqrt(freedom / (freedom - 2))
    spread = np.einsum("nci,c,ncj->ij", parts, variance, parts)
    return spread * np.outer(wider, wider)


def _check_turn(down: NDArray) -> None:
    sizes = np.linalg.svd(down - down.mean(axis=0), compute_uv=False) / np.sqrt(len(down))
    turn = float(np.degrees(sizes[1]))
    if turn < LEAST_TURN_DEG:
        raise ValueError(
            f"poses: expected the vertical to turn by {LEAST_TURN_DEG:g} degrees or more about two"
            f" axes of the handle, found {turn:.1f} (root mean square); hold it with the tip down,"
            " up, and level to four sides"
        )


def _check_weight(weight_n: float, off: NDArray, wrench: NDArray) -> None:
    left = float(_noise(off)[0])
    if np.abs(wrench[:, :3]).max() > STRONGEST_HAND_N:
        expected = "the weight of a load in newtons"
        raise ValueError(f"force: expected {expected}, found {weight_n:.3g} (its unit?)")
    told = weight_n > 0 and weight_n >= SURE * left / np.sqrt(len(off))
    if left > LARGEST_MISFIT * weight_n and (told or left > UNEXPLAINED_N):
        raise ValueError(
            f"force: expected the weight of one load at rest, found {_mn(left)} of {_mn(weight_n)}"
            " mN not explained (sign or order of a channel, the vertical turned round, something"
            " that touches the probe?)"
        )
    if not told:
        raise ValueError(
            f"force: expected the weight of a load, found {_mn(weight_n)} mN where readings are off"
            f" by {_mn(left)} mN"
        )


def _refuse_pose(name: str, off: NDArray) -> None:
    force, torque = (float(np.linalg.norm(part)) for part in np.split(off, 2))
    raise ValueError(
        f"force: expected the weight of one load at rest in all poses, found another at {name}, by"
        f" {_mn(force)} mN and {torque * MILLINEWTONS:.2g} mNm (a finger or a cable on it?)"
    )


def _mn(force_n: float) -> str:
    return f"{force_n * MILLINEWTONS:.1f}"


def _check_centre(centre: NDArray) -> None:
    away_m = float(np.linalg.norm(centre))
    if away_m > FARTHEST_CENTRE_M:
        raise ValueError(
            f"torque: expected a centre of mass within {FARTHEST_CENTRE_M:g} m of the sensor, found"
            f" it {away_m:.3g} m away (its unit?)"
        )
