"""Payload of the force sensor and the sensor's axes, from static poses in the air."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, hypot, radians, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares
from scipy.spatial.transform import Rotation
from scipy.special import fdtrc

from palpate.units import GRAVITY_M_S2, MILLIMETRES, MILLINEWTONS, PERCENT
from palpate.vision.force import STRONGEST_N
from palpate.vision.pivot import largest_std, turned
from palpate.vision.pose import by_turn
from palpate.vision.probe_recordings import StaticPoses
from palpate.yaml_files import mismatch

FEWEST_POSES = 6
# Root mean square by which the vertical must turn about two axes of the handle; one that is held
# upright, upside down and level to four sides has 35.
LEAST_TURN_DEG = 10.0
# Of the weight: what poses and wrenches of one handle may leave; wrong signs leave half and more.
LARGEST_MISFIT = 0.2
# Readings of a sensor without a payload are off by less; where they are not, a weight is misread.
UNEXPLAINED_N = 0.03
SURE = 5.0
# How seldom a pose that nothing touches is taken for a touched one, and how many of many may be
# touched. Of fewer poses than nine whose noise is not known the one that counts most would be.
FEWEST_TELL_NOISE = 9
UNLIKELY, MOST_LEFT_OUT = 1e-6, 0.1
ROUNDED = 1e-6
TINY = np.finfo(float).tiny ** 0.5
# Student's distribution has a variance from so many degrees of freedom on.
LEAST_FREEDOM = 3.0
# No handle is so long; torques in another unit have it farther.
FARTHEST_CENTRE_M = 0.5
# Where the unknowns stand: weight, turn, bias of the forces; centre of mass, bias of the torques.
WEIGHT, TURN, BIAS_N = 0, slice(1, 4), slice(4, 7)
CENTRE, BIAS_NM = slice(7, 10), slice(10, 13)
UNKNOWNS = ["mass_kg"] + [
    f"{name}_{axis}" for name in ("turn_rad", "bias_n", "centre_m", "bias_nm") for axis in "xyz"
]
# Standard deviations up to which a payload is determined: a hundredth of a newton, and what it
# takes for the direction of an indentation to be right to half a percent of its force.
MASS_KG, CENTRE_M, TURN_DEG = 0.001, 0.001, 0.3
# Of a channel's scale: what calibrations of a maker are right to; and of the weight's changes,
# from which it is judged.
GAIN, LEAST_SHARE = 0.03, 1e-3
# A table that a spirit level calls level is so to half a degree: a uniform distribution, 0.005 rad.
LEVEL_STD_RAD = radians(0.5) / sqrt(3)


@dataclass(frozen=True)
class Payload:
    """A payload of the sensor, and how well the poses determine it."""

    mass_kg: float
    centre_of_mass_m: NDArray  # (3,), in the force sensor's frame
    bias: NDArray  # (6,), what the sensor reads without a payload [N, Nm]
    marker_from_force: NDArray  # (3, 3), rotation of the sensor in the target's frame
    # (13, 13), of `UNKNOWNS`: mass [kg], rotation vector in the force frame [rad], bias of the
    # forces [N], centre of mass [m], and bias of the torques [Nm]
    covariance: NDArray
    residuals: NDArray  # (n, 6), of each pose [N, Nm]
    kept: NDArray  # (n,) bool, poses that count
    weight_n: NDArray  # (n, 3), of the payload at each pose, force frame [N]

    @property
    def std(self) -> NDArray:
        """Standard deviations of the thirteen unknowns, as ``covariance`` has them."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def turn_std_deg(self) -> float:
        """Standard deviation of the sensor's rotation, about the axis that is determined worst."""
        return degrees(largest_std(self.covariance[TURN, TURN]))

    @property
    def axes_std_rad(self) -> float:
        """Deviation of the sensor's turn [rad]: by the poses, and by the vertical."""
        # What poses that turn about the vertical take back of its error is not counted on.
        return hypot(radians(self.turn_std_deg), LEVEL_STD_RAD)

    @property
    def verdict(self) -> list[str]:
        """Whether the poses determine each part, a line each, and a warning."""
        worst_m, lines = float(self.std[CENTRE].max()), []
        for part, determined, how in (
            ("mass", self.std[0] <= MASS_KG, f"{self.std[0] * 1e3:.2g} g"),
            ("centre of mass", worst_m <= CENTRE_M, f"{worst_m * MILLIMETRES:.2g} mm"),
            ("rotation", self.turn_std_deg <= TURN_DEG, f"{self.turn_std_deg:.2g} degrees"),
        ):
            more = "" if determined else ": hold it longer, in more poses that differ more"
            lines.append(f"{part}: {'' if determined else 'not '}determined, to {how}{more}")
        gains, std = _gains(self.weight_n[self.kept], self.residuals[self.kept, :3])
        apart = gains - np.median(gains)
        worst = int(np.argmax(np.abs(apart)))
        if abs(apart[worst]) > max(GAIN, SURE * std[worst]):
            lines.append(
                f"warning: f{'xyz'[worst]} reads {PERCENT * apart[worst]:+.2g} % of the weight"
                " against the other forces: its scale, or that of its amplifier?"
            )
        return lines

    def left_out(self, names: Sequence[str]) -> dict[str, list[float]]:
        """Poses that were left out, and by how much force and torque are off [N, Nm]."""
        off = np.linalg.norm(self.residuals.reshape(-1, 2, 3), axis=2)
        return {names[k]: off[k].tolist() for k in np.flatnonzero(~self.kept)}

    def fields(self, names: Sequence[str], probe: str | None) -> dict:
        """What load.json says, of a probe by its name where that is known."""
        return {
            "probe": probe,
            "mass_kg": self.mass_kg,
            "mass_std_kg": float(self.std[0]),
            "centre_of_mass_m": self.centre_of_mass_m.tolist(),
            "bias_n_nm": self.bias.tolist(),
            "marker_from_force_rotation": self.marker_from_force.tolist(),
            "axes_std_rad": self.axes_std_rad,
            "unknowns": UNKNOWNS,
            "covariance": self.covariance.tolist(),
            "poses": len(names),
            "left_out_n_nm": self.left_out(names),
            "verdict": self.verdict,
        }


def find_payload(poses: StaticPoses, up: NDArray) -> Payload:
    """Weight, centre of mass, biases and rotation that explain wrenches at rest.

    A pose is left out whose wrench the others do not explain.

    Parameters
    ----------
    poses : StaticPoses
        Where their noise is not known it is that of the residuals, of forces and of torques each.
        Deviations are never less than the residuals say.
    up : (3,) array
        Upward direction, camera frame.

    Raises
    ------
    ValueError
        If there are less than six poses, they are alike, the sensor feels no weight, none that
        turns as the target does, or one that hangs farther away than a handle is long, or wrenches
        of too many poses are others.
    """
    wrench, count, known = poses.wrench, len(poses.wrench), poses.noise is not None
    if count < FEWEST_POSES:
        raise ValueError(f"poses: expected at least {FEWEST_POSES}, found {count}")
    down = -poses.turns.transpose(0, 2, 1) @ (up / np.linalg.norm(up))
    kept = np.ones(count, dtype=bool)
    fewest = max(FEWEST_POSES, count - max(1, int(MOST_LEFT_OUT * count)))
    while True:
        fit, start = _fitted(down[kept], wrench[kept], poses.noise)
        worst = _outlier(fit, known=known)
        if worst is None or kept.sum() == fewest:
            break
        kept[np.flatnonzero(kept)[worst]] = False
    weight_n = float(fit.x[WEIGHT])
    residuals = _residuals(fit.x, down, start, wrench)
    _check(weight_n, fit.x[CENTRE], residuals[kept], wrench)
    if worst is not None:
        place = int(np.flatnonzero(kept)[worst])
        force_n, torque_nm = np.linalg.norm(residuals[place].reshape(2, 3), axis=1)
        off = f"by {_mn(force_n)} mN and {torque_nm * MILLINEWTONS:.2g} mNm"
        found = f"another at {poses.names[place]}, {off} (a finger or a cable on it?)"
        raise mismatch("force", "the weight of one load at rest in all poses", found)
    per_newton = np.r_[1 / GRAVITY_M_S2, np.ones(len(UNKNOWNS) - 1)]
    turn = Rotation.from_rotvec(fit.x[TURN]).as_matrix() @ start
    return Payload(
        mass_kg=weight_n / GRAVITY_M_S2,
        centre_of_mass_m=fit.x[CENTRE],
        bias=np.append(fit.x[BIAS_N], fit.x[BIAS_NM]),
        marker_from_force=turn.T,
        covariance=_covariance(fit, known=known) * np.outer(per_newton, per_newton),
        residuals=residuals,
        kept=kept,
        weight_n=weight_n * down @ turn.T,
    )


def _fitted(
    down: NDArray, wrench: NDArray, noise: NDArray | None
) -> tuple[OptimizeResult, NDArray]:
    """Whitened least squares, and the rotation force_from_marker after which its turn comes."""
    if (turn := degrees(turned(down[:, None])[0][1])) < LEAST_TURN_DEG:
        wanted = f"by {LEAST_TURN_DEG:g} degrees or more about two axes of the handle"
        remedy = "hold it with the tip down, up, and level to four sides"
        found = f"{turn:.1f} (root mean square); {remedy}"
        raise mismatch("poses", f"the vertical to turn {wanted}", found)
    if not np.ptp(wrench[:, :3], axis=0).any():
        raise ValueError("force: expected the weight of a load, found forces that never change")
    x, start = _start(down, wrench)
    scale = _noise(_residuals(x, down, start, wrench)) if noise is None else noise

    def whitened(x: NDArray) -> NDArray:
        return (_residuals(x, down, start, wrench) / scale).ravel()

    return least_squares(whitened, x, x_scale="jac", method="lm"), start


def _parts(fit: OptimizeResult) -> tuple[NDArray, NDArray, NDArray]:
    """Whitened residuals (n, 6), their derivatives (n, 6, 13), and the inverse of its square."""
    jacobian = fit.jac.reshape(-1, 6, len(UNKNOWNS))
    inverse = np.linalg.inv(np.einsum("nci,ncj->ij", jacobian, jacobian))
    return fit.fun.reshape(-1, 6), jacobian, inverse


def _outlier(fit: OptimizeResult, *, known: bool) -> int | None:
    """The pose whose forces or torques are surely others than the other poses say, if one is."""
    every, jacobian, inverse = _parts(fit)
    if not known and len(every) < FEWEST_TELL_NOISE:
        return None
    # How much less is left without it, against what is left of the others, or against the noise
    # where that is known and more: Fisher's distribution.
    sure = np.ones(len(every))
    for part in (slice(0, 3), slice(3, 6)):
        rows, off = jacobian[:, part], every[:, part]
        own = rows @ inverse @ rows.transpose(0, 2, 1)
        free = off.size - np.trace(own, axis1=1, axis2=2).sum() - 3
        # A pose that alone determines an unknown has nothing left.
        more = np.linalg.solve((1 + ROUNDED) * np.eye(3) - own, off[..., None])[..., 0]
        square = (off * more).sum(axis=1)
        # Readings without noise leave rounding alone.
        rest = np.maximum(((off**2).sum() - square) / free, 1 if known else TINY)
        sure = np.minimum(sure, fdtrc(3, free, square / 3 / rest))
    worst = int(np.argmin(sure))
    return worst if sure[worst] < UNLIKELY / (2 * len(every)) else None


def _covariance(fit: OptimizeResult, *, known: bool) -> NDArray:
    """Of the unknowns, where each channel is off by its noise and by what the poses are off by."""
    off, jacobian, inverse = _parts(fit)
    parts = jacobian @ inverse
    free = len(off) - np.einsum("nci,nci->c", parts, jacobian)
    variance = (off**2).sum(axis=0) / free
    variance = np.maximum(variance, 1) if known else variance
    # Few residuals determine a variance badly: an error over its deviation is Student's, with the
    # degrees of freedom of B. L. Welch (1947), and has the variance of that.
    guessed = 1 - 1 / variance if known else np.ones(6)
    by_channel = variance[:, None] * (parts**2).sum(axis=0)
    unsure = ((guessed[:, None] * by_channel) ** 2 / free[:, None]).sum(axis=0)
    freedom = by_channel.sum(axis=0) ** 2 / np.maximum(unsure, np.finfo(float).tiny)
    freedom = np.maximum(freedom, LEAST_FREEDOM)
    wider = np.sqrt(freedom / (freedom - 2))
    return np.einsum("nci,c,ncj->ij", parts, variance, parts) * np.outer(wider, wider)


def _start(down: NDArray, wrench: NDArray) -> tuple[NDArray, NDArray]:
    """Unknowns and rotation of the forces (S. Umeyama, 1991, Eq. 40-42), then of the torques."""
    middle, mean = down.mean(axis=0), wrench[:, :3].mean(axis=0)
    left, sizes, right = np.linalg.svd((wrench[:, :3] - mean).T @ (down - middle))
    signs = np.array([1, 1, np.linalg.det(left @ right)])
    turn, x = left * signs @ right, np.zeros(len(UNKNOWNS))
    x[WEIGHT] = sizes @ signs / ((down - middle) ** 2).sum()
    x[BIAS_N] = mean - x[WEIGHT] * turn @ middle
    # Torque is centre x weight + bias.
    weight = x[WEIGHT] * down @ turn.T
    rows = np.dstack([by_turn(weight), np.tile(np.eye(3), (len(weight), 1, 1))]).reshape(-1, 6)
    found = np.linalg.lstsq(rows, wrench[:, 3:].ravel(), rcond=None)[0]
    x[CENTRE], x[BIAS_NM] = np.split(found, 2)
    return x, turn


def _residuals(x: NDArray, down: NDArray, start: NDArray, wrench: NDArray) -> NDArray:
    """Reading less that of a payload, (n, 6) [N, Nm]."""
    weight = x[WEIGHT] * down @ (Rotation.from_rotvec(x[TURN]).as_matrix() @ start).T
    load = np.hstack([weight + x[BIAS_N], np.cross(x[CENTRE], weight) + x[BIAS_NM]])
    return wrench - load


def _noise(residuals: NDArray) -> NDArray:
    """Standard deviation of forces and of torques, (6,), less the unknowns of each."""
    free = 3 * len(residuals) - np.array([7, 6])
    square = (residuals**2).reshape(-1, 2, 3).sum(axis=(0, 2)) / free
    # Readings without noise leave rounding alone.
    return np.repeat(np.sqrt(np.maximum(square, TINY)), 3)


def _gains(weight: NDArray, off: NDArray) -> tuple[NDArray, NDArray]:
    """What each force channel reads more of the weight's changes, and its deviation, (3,) each."""
    weight = weight - weight.mean(axis=0)
    square = (weight**2).sum(axis=0)
    # A channel that the weight hardly changes says nothing of its own scale.
    square = np.where(square > LEAST_SHARE * square.sum(), square, np.inf)
    gains = (weight * off).sum(axis=0) / square
    left = off - off.mean(axis=0) - gains * weight
    return gains, np.sqrt((left**2).sum(axis=0) / (len(off) - 2) / square)


def _check(weight_n: float, centre_m: NDArray, off: NDArray, wrench: NDArray) -> None:
    left, away_m = float(_noise(off)[0]), float(np.linalg.norm(centre_m))
    if np.abs(wrench[:, :3]).max() > STRONGEST_N:
        raise mismatch("force", "the weight of a load in newtons", f"{weight_n:.3g} (its unit?)")
    determined = weight_n > 0 and weight_n >= SURE * left / np.sqrt(len(off))
    if left > LARGEST_MISFIT * weight_n and (determined or left > UNEXPLAINED_N):
        raise ValueError(
            f"force: expected the weight of one load at rest, found {_mn(left)} of {_mn(weight_n)}"
            " mN not explained (sign or order of a channel, the vertical turned round, something"
            " that touches the probe?)"
        )
    if not determined:
        found = f"{_mn(weight_n)} mN where readings are off by {_mn(left)} mN"
        raise mismatch("force", "the weight of a load", found)
    if away_m > FARTHEST_CENTRE_M:
        expected = f"a centre of mass within {FARTHEST_CENTRE_M:g} m of the sensor"
        raise mismatch("torque", expected, f"it {away_m:.3g} m away (its unit?)")


def _mn(force_n: float) -> str:
    return f"{force_n * MILLINEWTONS:.1f}"
