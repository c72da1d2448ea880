"""Compliance of a probe, from an indentation of something rigid."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import hypot, inf, isfinite, nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from palpate.capture.curves.phases import noise_of
from palpate.units import MILLIMETRES
from palpate.vision.force import FORCE, STRONGEST_N, zeroed
from palpate.vision.indentation import frame_wrenches
from palpate.vision.options import Force
from palpate.vision.probe import marker_from_tip, marker_transforms
from palpate.yaml_files import mismatch

# Below it the ball may not rest yet: as much counts as contact of an object.
CONTACT_N = 0.5
FEWEST_SAMPLES = 10
# What a line needs: so much force between its ends, and so many times the force's noise, which
# else flattens it by more than the correction for it is sure of.
LEAST_RANGE_N, LEAST_RANGE_NOISES = 1.0, 20.0
# Of fewer rows, such as weights that were hung, neighbours differ by steps and not by noise.
FEWEST_OF_NOISE = 50
# At 5 N it is 2.5 mm, as deep as an indentation: target and tip go different ways then.
LEAST_STIFFNESS_N_M = 2000.0
# Of the way: Hertz's power of 2/3 bows by 0.08, and rubber gives back its way later than that.
MOST_BOWED, MOST_APART = 0.05, 0.1
# No depth camera sees so little, whatever part of a short way it is.
LEAST_OFF_M = 2e-5
# Nor does one determine more than this, as a table without noise would have it.
LEAST_STD_M_N, LEAST_STD_M = 1e-8, 1e-7
SURE, DETERMINED = 5.0, 3.0
ONE_SIDED_95 = 1.645
# Of the record: so long are means that find contact, and loading from unloading; of the steepest
# change of force, what is held; of the samples, what both must have to be compared.
SMOOTH, HELD, FEWEST_OF_EACH = 0.02, 0.1, 0.1
# Residuals that are correlated more are a drift, which no number of samples averages out.
MOST_AUTOCORRELATION = 0.98
# Deviation up to which all is determined: at 5 N it puts the depth 0.02 mm off; and the stiffness
# above which nothing need be known, 0.05 mm at 5 N.
LARGEST_STD_M_N, STIFF_N_M = 0.02e-3 / 5, 1e5


@dataclass(frozen=True)
class Compliance:
    """Compliance of a probe, and how well the indentation determines it."""

    # way of each newton, and its standard deviation [m/N]
    compliance_m_n: float
    compliance_std_m_n: float
    samples: int  # in contact
    force_n: tuple[float, float]  # least and greatest of them
    rms_m: float  # root mean square of what the line leaves of the way
    # how far the way bows from its chord, how far unloading lies from loading, each with its
    # standard deviation; the gap is nan where the record has one of both alone
    bow_m: tuple[float, float]
    gap_m: tuple[float, float]

    @property
    def determined(self) -> bool:
        """Whether the compliance is above 0, by three standard deviations."""
        return self.compliance_m_n > DETERMINED * self.compliance_std_m_n

    @property
    def file_std_m_n(self) -> float:
        """Standard uncertainty of the compliance that is taken: 0 where it is not determined."""
        return hypot(self.compliance_std_m_n, 0.0 if self.determined else self.compliance_m_n)

    @property
    def stiffness_n_m(self) -> float:
        """Force of each metre; infinite where the compliance is not above 0."""
        return 1 / self.compliance_m_n if self.compliance_m_n > 0 else inf

    @property
    def std_n_m(self) -> float:
        """Standard deviation of the stiffness, where it is determined."""
        return self.compliance_std_m_n * self.stiffness_n_m**2

    @property
    def least_n_m(self) -> float:
        """What the stiffness is above, 95 % sure."""
        most = max(self.compliance_m_n, 0.0) + ONE_SIDED_95 * self.compliance_std_m_n
        return 1 / most if most > 0 else inf

    @property
    def verdict(self) -> str:
        """Whether the stiffness is determined, and what to do."""
        if self.determined:
            sure = self.compliance_std_m_n <= LARGEST_STD_M_N
            more = "" if sure else ": press harder, or more often"
            return f"stiffness: determined, to {digits(self.std_n_m)} N/m{more}"
        enough = "leave it out of the probe's file"
        if self.least_n_m < STIFF_N_M:
            enough += f"; to know whether it is above {STIFF_N_M:g}, press harder or more often"
        stiffer = f"stiffer than {digits(self.least_n_m)} N/m (95 %)"
        return f"stiffness: not determined, {stiffer}: {enough}"

    def fields(self, probe: str | None) -> dict:
        """What stiffness.json says, of a probe by its name where that is known."""
        return {
            "probe": probe,
            "stiffness_n_m": self.stiffness_n_m if self.determined else None,
            "stiffness_std_n_m": self.std_n_m if self.determined else None,
            "stiffer_than_n_m": self.least_n_m if isfinite(self.least_n_m) else None,
            **asdict(self),
            "gap_m": self.gap_m if isfinite(self.gap_m[0]) else None,
            "verdict": self.verdict,
        }


def digits(value: float, count: int = 2) -> str:
    """A number to so many digits, without a power of ten."""
    return np.format_float_positional(value, count, unique=False, fractional=False, trim="-")


def recorded_press(
    table: pd.DataFrame, record: pd.DataFrame, probe: Mapping, options: Force
) -> tuple[NDArray, NDArray]:
    """How far the tip went [m] and its force [N], (n,), along the pressed frames' mean axis.

    The force's offset is the unloaded sensor's before the indentation; the payload weighs the same
    in all frames of a handle that does not turn.

    Parameters
    ----------
    table, record : DataFrame
        Of `palpate.vision.follow.board_followed`, and force.csv of the recording.
    probe : mapping
        With ``marker_from_force`` and ``force_from_tip``, and ``gauge`` where the record is volts.
    options : Force

    Raises
    ------
    ValueError
        If no frame is pressed, or as `zeroed` and `frame_wrenches` do.
    """
    frames_s, poses = table["time_s"].to_numpy(float), marker_transforms(table)
    known = zeroed(record, probe, options.bias_window_s, frames_s[0])
    wrenches = frame_wrenches(known, table, probe, options)
    force, tips = wrenches[FORCE].to_numpy(), poses @ marker_from_tip(probe)
    along_n = np.einsum("ni,ni->n", force, tips[:, :3, 2])
    pressed = along_n > CONTACT_N
    if not pressed.any():
        found = f"{along_n.max():.2g} N (sign of the channels, marker_from_force?)"
        raise mismatch("force", f"a press above {CONTACT_N:g} N along the probe's axis", found)
    axis = tips[pressed, :3, 2].mean(axis=0)
    axis /= np.linalg.norm(axis)
    return tips[:, :3, 3] @ axis, force @ axis


def find_compliance(way_m: NDArray, force_n: NDArray) -> Compliance:
    """Way over force of a slow indentation of something rigid, its offset free.

    Parameters
    ----------
    way_m, force_n : (n,) arrays
        Of the tip along the pressing axis, by the target's poses, in the order of time [m]; and the
        force along it at the same moments [N].

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
    # By its own noise a sample at the edge would be chosen where it is read too high.
    smooth = uniform_filter1d(force_n, max(1, round(SMOOTH * len(force_n))), mode="nearest")
    noise_n = noise_of(force_n) if len(force_n) >= FEWEST_OF_NOISE else 0.0
    _check_force(force_n, smooth, noise_n)
    chosen, change = smooth > CONTACT_N, np.gradient(smooth)
    change[np.abs(change) <= HELD * np.abs(change).max()] = 0
    way, force = way_m[chosen], force_n[chosen]
    departures, factor = _departures(way, force, np.sign(change[chosen]))
    centred = force - force.mean()
    square = float(centred @ centred)
    spread = square - len(force) * noise_n**2
    slope = float(centred @ way) / spread
    off = way - way.mean() - slope * centred
    std = np.sqrt(factor * float(off @ off) / (len(off) - 2) * square) / spread
    found = Compliance(
        compliance_m_n=slope,
        compliance_std_m_n=max(float(std), LEAST_STD_M_N),
        samples=len(force),
        force_n=(float(force.min()), float(force.max())),
        rms_m=float(np.sqrt((off**2).mean())),
        bow_m=departures[0],
        gap_m=departures[1] if len(departures) > 1 else (nan, nan),
    )
    _check_way(found)
    return found


def _departures(
    way: NDArray, force: NDArray, direction: NDArray
) -> tuple[list[tuple[float, float]], float]:
    """Bow over its chord, gap of loading (1) and unloading (-1) if any; what variances grow by."""
    part = (force - force.min()) / np.ptp(force)
    each = min(int((direction > 0).sum()), int((direction < 0).sum()))
    gap = [-direction / 2] if each >= max(2, FEWEST_OF_EACH * len(force)) else []
    rows = np.column_stack([np.ones_like(force), force, 4 * part * (1 - part), *gap])
    parts = np.linalg.lstsq(rows, way, rcond=None)[0]
    off = way - rows @ parts
    square = float(off @ off)
    # Errors of neighbours are correlated where a target's error changes with its place: independent
    # samples are fewer, as of a first-order autoregression.
    alike = float(off[1:] @ off[:-1]) / square if square > 0 else 0.0
    alike = min(max(alike, 0.0), MOST_AUTOCORRELATION)
    factor = (1 + alike) / (1 - alike)
    variance = factor * square / (len(way) - len(parts))
    errors = np.sqrt(variance * np.diag(np.linalg.pinv(rows.T @ rows)))
    pairs = zip(parts.tolist(), np.maximum(errors, LEAST_STD_M).tolist(), strict=True)
    return list(pairs)[2:], factor


def _check_force(force: NDArray, smooth: NDArray, noise_n: float) -> None:
    chosen = smooth > CONTACT_N
    if chosen.sum() < FEWEST_SAMPLES:
        expected = f"{FEWEST_SAMPLES} samples or more above {CONTACT_N:g} N"
        turned = (smooth < -CONTACT_N).sum() >= FEWEST_SAMPLES
        sign = " (presses are positive here: turn the sign?)" if turned else ""
        raise mismatch("force", expected, f"{chosen.sum()} of {len(force)}{sign}")
    if (most := np.abs(force).max()) > STRONGEST_N:
        raise ValueError(f"force: expected newtons of an operator, found {most:.4g} N (its unit?)")
    range_n = float(np.ptp(force[chosen]))
    least = max(LEAST_RANGE_N, LEAST_RANGE_NOISES * noise_n)
    if range_n < least:
        expected = f"a press over {least:.2g} N or more above {CONTACT_N:g} N"
        noise = f"(its noise is {noise_n:.2g} N)"
        raise mismatch("force", f"{expected} {noise}", f"{range_n:.2g} N; press harder")


def _check_way(found: Compliance) -> None:
    """Reject what is no probe on something rigid."""
    range_n = found.force_n[1] - found.force_n[0]
    whole_m = found.compliance_m_n * range_n
    over, whole = f"over {range_n:.2g} N", f"{_mm(whole_m)} mm"
    if whole_m < -max(SURE * found.compliance_std_m_n * range_n, LEAST_OFF_M):
        shorter = f"it {_mm(-whole_m)} mm shorter {over} (the sign of one of them?)"
        raise mismatch("way", "it to grow with the force", shorter)
    if _is_off(found.bow_m, MOST_BOWED * whole_m):
        off = f"it {_mm(*np.abs(found.bow_m))} mm off its chord of {whole} {over}"
        hint = "(does what is pressed give way itself, or the board's glue?)"
        raise mismatch("way", "it in proportion to the force", f"{off} {hint}")
    if found.determined and found.stiffness_n_m < LEAST_STIFFNESS_N_M:
        raise ValueError(
            f"way: expected {LEAST_STIFFNESS_N_M:g} N/m or more, found {found.stiffness_n_m:.3g}: a"
            f" probe that gives way by {_mm(5 / LEAST_STIFFNESS_N_M)} mm at 5 N goes as far as it"
            " presses (is what is pressed rigid, the unit of the way right, a screw loose?)"
        )
    if _is_off(found.gap_m, MOST_APART * whole_m):
        off = f"unloading {_mm(*np.abs(found.gap_m))} mm off where the way is {whole} {over}"
        hint = "(slower; does something slide or creep, are the clocks apart?)"
        raise mismatch("way", "loading and unloading alike", f"{off} {hint}")


def _is_off(value: tuple[float, float], most_m: float) -> bool:
    """Whether a departure is surely more than it may be; one that is not known is not."""
    return abs(value[0]) > max(SURE * value[1], most_m, LEAST_OFF_M)


def _mm(*lengths_m: float) -> str:
    return " +- ".join(f"{length_m * MILLIMETRES:.2g}" for length_m in lengths_m)
