"""What a probe gives way by, from a press of its ball on something rigid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from palpate.capture.curves.phases import noise_of
from palpate.units import MILLIMETRES
from palpate.vision.force import STRONGEST_HAND_N

# Below it the ball may not rest yet: as much counts as contact of an object.
CONTACT_N = 0.5
FEWEST_SAMPLES = 10
# What a line wants: so much force between its ends, and so many times the force's noise, which
# else flattens it by more than the correction for it is sure of.
LEAST_RANGE_N, LEAST_RANGE_NOISES = 1.0, 20.0
# Of fewer rows, such as weights that were hung, neighbours differ by steps and not by noise.
FEWEST_OF_NOISE = 50
# At 5 N it gives way by 2.5 mm, as deep as a press is: board and tip go different ways then.
LEAST_STIFFNESS_N_M = 2000.0
# Of the way: Hertz's power of 2/3 bows by 0.08, and rubber gives back its way later than that.
MOST_BOWED, MOST_APART = 0.05, 0.1
# No depth camera sees so little, whatever part of a short way it is.
LEAST_OFF_M = 2e-5
# Nor does one tell more than this, as a table without noise would have it.
LEAST_STD_M_N, LEAST_STD_M = 1e-8, 1e-7
SURE, TOLD = 5.0, 3.0
ONE_SIDED_95 = 1.645
# Of the record: so long are means that tell contact, and loading from unloading; of the steepest
# change of force, what is held; of the samples, what both must have to be compared.
SMOOTH, HELD, FEWEST_OF_EACH = 0.02, 0.1, 0.1
# Residuals that hang together more are a drift, of which no number of samples tells anything.
MOST_AUTOCORRELATION = 0.98


@dataclass(frozen=True)
class Bending:
    """What a probe gives way by, and how well the press tells it.

    Attributes
    ----------
    compliance_m_n, compliance_std_m_n : float
        Way of each newton, and its standard deviation [m/N].
    samples : int
        In contact.
    force_n : (float, float)
        Least and greatest of them.
    rms_m : float
        Root mean square of what the line leaves of the way.
    bow_m, gap_m : (float, float)
        How far the way bows from its chord, how far unloading lies from loading, each with its
        standard deviation; the gap is nan where the press has one of both alone.
    """

    compliance_m_n: float
    compliance_std_m_n: float
    samples: int
    force_n: tuple[float, float]
    rms_m: float
    bow_m: tuple[float, float]
    gap_m: tuple[float, float]

    @property
    def told(self) -> bool:
        """Whether the press tells that the probe gives way, by three standard deviations."""
        return self.compliance_m_n > TOLD * self.compliance_std_m_n

    @property
    def file_std_m_n(self) -> float:
        """Standard uncertainty of the compliance that is taken: of none where none is told."""
        left = 0.0 if self.told else self.compliance_m_n
        return float(np.hypot(self.compliance_std_m_n, left))

    @property
    def stiffness_n_m(self) -> float:
        """Force of each metre; infinite where nothing gives way."""
        return 1 / self.compliance_m_n if self.compliance_m_n > 0 else np.inf

    @property
    def std_n_m(self) -> float:
        """Standard deviation of the stiffness, where it is told."""
        return self.compliance_std_m_n * self.stiffness_n_m**2

    @property
    def least_n_m(self) -> float:
        """What the stiffness is above, 95 % sure."""
        most = max(self.compliance_m_n, 0.0) + ONE_SIDED_95 * self.compliance_std_m_n
        return 1 / most if most > 0 else np.inf


def find_bending(way_m: NDArray, force_n: NDArray, *, contact_n: float = CONTACT_N) -> Bending:
    """Way over force of a slow press on something rigid, its zero free.

    Parameters
    ----------
    way_m : (n,) array
        Of the tip along the pressing axis, as the board tells it, in the order of time.
    force_n : (n,) array
        Along the same axis, at the same moments.
    contact_n : float
        Samples above it count.

    Raises
    ------
    ValueError
        If the force changes too little, the way does not grow with it, is not proportional to it or
        another in unloading, or is longer than a probe's.

    Notes
    -----
    The way's noise dominates. What the force's own flattens the line by is taken off by its
    variance (W. A. Fuller, Measurement error models, 1987, section 1.2).
    """
    smooth = uniform_filter1d(force_n, max(1, round(SMOOTH * len(force_n))), mode="nearest")
    # By its own noise a sample at the edge would be chosen where it is read too high.
    chosen = smooth > contact_n
    noise_n = noise_of(force_n) if len(force_n) >= FEWEST_OF_NOISE else 0.0
    # What would press if the sign were the other.
    turned = int((smooth < -contact_n).sum())
    _check_force(force_n, chosen, turned, contact_n, noise_n)
    way, force = way_m[chosen], force_n[chosen]
    extra = _departures(force, _direction(smooth)[chosen])
    parts, errors, factor = _full_fit(way, force, extra)
    centred = force - force.mean()
    spread = float(centred @ centred) - len(force) * noise_n**2
    slope = float(centred @ way) / spread
    off = way - way.mean() - slope * centred
    variance = factor * float(off @ off) / (len(off) - 2)
    std = float(np.sqrt(variance * (centred @ centred)) / spread)
    errors = np.maximum(errors, LEAST_STD_M)
    found = Bending(
        compliance_m_n=slope,
        compliance_std_m_n=max(std, LEAST_STD_M_N),
        samples=len(force),
        force_n=(float(force.min()), float(force.max())),
        rms_m=float(np.sqrt((off**2).mean())),
        bow_m=(float(parts[2]), float(errors[2])),
        gap_m=(float(parts[3]), float(errors[3])) if len(parts) > 3 else (np.nan, np.nan),
    )
    _check_way(found)
    return found


def _direction(smooth: NDArray) -> NDArray:
    """Whether each sample is of loading (1), unloading (-1) or held (0), (n,)."""
    change = np.gradient(smooth)
    return np.sign(change) * (np.abs(change) > HELD * np.abs(change).max())


def _departures(force: NDArray, direction: NDArray) -> list[NDArray]:
    """What a line has not, one metre high: a bow over its chord, a gap of loading and unloading."""
    part = (force - force.min()) / np.ptp(force)
    each = min(int((direction > 0).sum()), int((direction < 0).sum()))
    gap = [-direction / 2] if each >= max(2, FEWEST_OF_EACH * len(force)) else []
    return [4 * part * (1 - part), *gap]


def _full_fit(way: NDArray, force: NDArray, extra: list[NDArray]) -> tuple[NDArray, NDArray, float]:
    """Zero, slope and departures, their deviations, and by what their variances are larger.

    Errors of neighbours hang together where a board's error changes with its place: so many
    independent samples are fewer, as of a first-order autoregression.
    """
    rows = np.column_stack([np.ones_like(force), force, *extra])
    parts = np.linalg.lstsq(rows, way, rcond=None)[0]
    off = way - rows @ parts
    square = float(off @ off)
    alike = float(off[1:] @ off[:-1]) / square if square > 0 else 0.0
    alike = min(max(alike, 0.0), MOST_AUTOCORRELATION)
    factor = (1 + alike) / (1 - alike)
    variance = factor * square / (len(way) - len(parts))
    return parts, np.sqrt(variance * np.diag(np.linalg.pinv(rows.T @ rows))), factor


def _check_force(
    force: NDArray, chosen: NDArray, turned: int, contact_n: float, noise_n: float
) -> None:
    if chosen.sum() < FEWEST_SAMPLES:
        expected = f"{FEWEST_SAMPLES} samples or more above {contact_n:g} N"
        sign = " (presses are positive here: turn the sign?)" if turned >= FEWEST_SAMPLES else ""
        raise ValueError(f"force: expected {expected}, found {chosen.sum()} of {len(force)}{sign}")
    if np.abs(force).max() > STRONGEST_HAND_N:
        found = f"{np.abs(force).max():.4g} N"
        raise ValueError(f"force: expected newtons of a hand, found {found} (its unit?)")
    range_n = float(np.ptp(force[chosen]))
    least = max(LEAST_RANGE_N, LEAST_RANGE_NOISES * noise_n)
    if range_n < least:
        raise ValueError(
            f"force: expected a press over {least:.2g} N or more above {contact_n:g} N (its noise"
            f" is {noise_n:.2g} N), found {range_n:.2g} N; press harder"
        )


def _check_way(found: Bending) -> None:
    """Refuse what is no probe on something rigid."""
    range_n = found.force_n[1] - found.force_n[0]
    over, whole_m = f"over {range_n:.2g} N", found.compliance_m_n * range_n
    if whole_m < -max(SURE * found.compliance_std_m_n * range_n, LEAST_OFF_M):
        raise ValueError(
            f"way: expected it to grow with the force, found it {_mm(-whole_m)} mm shorter {over}"
            " (the sign of one of them?)"
        )
    if _is_off(found.bow_m, MOST_BOWED * whole_m):
        raise ValueError(
            f"way: expected it in proportion to the force, found it {_of(found.bow_m)} mm off its"
            f" chord of {_mm(whole_m)} mm {over} (does what is pressed give way itself, or the"
            " board's glue?)"
        )
    if found.told and found.stiffness_n_m < LEAST_STIFFNESS_N_M:
        raise ValueError(
            f"way: expected {LEAST_STIFFNESS_N_M:g} N/m or more, found {found.stiffness_n_m:.3g}: a"
            f" probe that gives way by {_mm(5 / LEAST_STIFFNESS_N_M)} mm at 5 N goes as far as it"
            " presses (is what is pressed rigid, the unit of the way right, a screw loose?)"
        )
    if _is_off(found.gap_m, MOST_APART * whole_m):
        raise ValueError(
            f"way: expected loading and unloading alike, found unloading {_of(found.gap_m)} mm off"
            f" where the way is {_mm(whole_m)} mm {over} (slower; does something slide or creep,"
            " are the clocks apart?)"
        )


def _is_off(value: tuple[float, float], most_m: float) -> bool:
    """Whether a departure is surely more than it may be; one that is not told is not."""
    return abs(value[0]) > max(SURE * value[1], most_m, LEAST_OFF_M)


def _of(value: tuple[float, float]) -> str:
    return f"{_mm(abs(value[0]))} +- {_mm(value[1])}"


def _mm(length_m: float) -> str:
    return f"{length_m * MILLIMETRES:.2g}"
