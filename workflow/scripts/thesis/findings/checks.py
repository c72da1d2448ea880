"""Computations behind the study's findings; each can come out either way."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pandas as pd

from thesis.findings.printed import BALL, BLOCK, EAR
from thesis.findings.sensor_checks import FIRST, SECOND
from thesis.findings.verdicts import Outcome, every, rank_test, sign_test

DISPLACEMENT, BOTH = "displacement", "force_displacement"
# Table 5.1's deviation is 8.7 % of its mean: less than that between places is no pattern.
LEAST_PATTERN = 1.09
MIDDLE_ROW, MIDDLE_COLUMNS = 2, (2, 5)
SPREAD = 0.10
EXACT, CLOSE, FAR = 1e-3, 0.10, 0.5
MUCH_LESS = 0.5
# The tracker errs by 0.3 to 0.7 mm: noise of 0.1 to 1 mm encloses that.
NOISE_M = 1e-4, 1e-3
# Decimals of moduli [Pa] and ratios in the evidence.
DIGITS = {"youngs_modulus_pa": 0, "poisson_ratio": 3}
UNITS = {"youngs_modulus_pa": "Pa", "reduced_modulus_pa": "Pa"}
NU, VERDICT, IDENTIFIED = "poisson_ratio", "poisson_ratio_verdict", "identified"
LAME = ["lame_lambda_pa", "lame_mu_pa"]
Check = Callable[[pd.DataFrame], Outcome]
PLACE = ["object", "sensor", "point", "error"]


def stiffer_in_the_middle(points: pd.DataFrame) -> Outcome:
    """Hertz's E* of the inner points of the middle row against all others, by sensor."""
    inner = points["row"].eq(MIDDLE_ROW) & points["column"].between(*MIDDLE_COLUMNS)
    values = points["reduced_modulus_pa"]
    return every(
        [
            (sensor, rank_test(values[mine & inner], values[mine & ~inner],
                               least_ratio=LEAST_PATTERN))
            for sensor in sorted(points["sensor"].unique())
            for mine in [points["sensor"] == sensor]
        ]
    )  # fmt: skip


def repeatable(repeats: pd.DataFrame) -> Outcome:
    """Relative standard deviation of the attempts at one point."""
    values = repeats["reduced_modulus_pa"].to_numpy(float)
    if len(values) < 3:
        return Outcome(f"only {len(values)} attempts", None)
    spread = values.std(ddof=1) / values.mean()
    return Outcome(
        f"{100 * spread:.1f} % of the mean over {len(values)} attempts", bool(spread < SPREAD)
    )


def larger_by_displacement(estimates: pd.DataFrame, *, quantity: str) -> Outcome:
    """The displacement error's value against the combined error's, capture by capture."""
    return _paired(estimates, quantity, "error", DISPLACEMENT, BOTH)


def larger_by_kinect(estimates: pd.DataFrame, *, quantity: str) -> Outcome:
    """The Kinect's value against the Bumblebee's: means of both error options, by point."""
    keys = ["object", "sensor", "point"]
    table = estimates.assign(point=estimates["point"].fillna(""))
    # A place without one of the options has no mean.
    means = table.pivot_table(index=keys, columns="error", values=quantity, dropna=False)
    means = means.reindex(columns=[DISPLACEMENT, BOTH]).mean(axis=1, skipna=False)
    return _paired(means.rename(quantity).reset_index(), quantity, "sensor", SECOND, FIRST)


def where_identified(estimates: pd.DataFrame, *, check: Check) -> Outcome:
    """A check on nu, of the minima alone whose own verdict is that they identify it.

    A printed nu has no verdict and counts as it is.
    """
    everything = check(estimates)
    if VERDICT not in estimates:
        return everything
    known = estimates[VERDICT] == IDENTIFIED
    kept = check(estimates.assign(poisson_ratio=estimates[NU].where(known)))
    if known.all():
        return kept
    text = "too few identify nu" if kept.holds is None else kept.evidence
    text += f" ({_verdicts(estimates)}); whatever their verdict: {everything.evidence}"
    return Outcome(text, kept.holds)


def identified_in_words(estimates: pd.DataFrame) -> str:
    """How many of the minima identify nu, which E of the same minimum depends on; may be empty."""
    if VERDICT not in estimates or (estimates[VERDICT] == IDENTIFIED).all():
        return ""
    return f"verdicts of the minima on nu: {_verdicts(estimates)}; E depends on it"


def _verdicts(estimates: pd.DataFrame) -> str:
    counts = estimates[VERDICT].value_counts().sort_index()
    return ", ".join(f"{name} {count}" for name, count in counts.items())


def below_hertz(estimates: pd.DataFrame) -> Outcome:
    """The combined error's E* against Hertz's."""
    mine = estimates[estimates["error"] == BOTH]
    mine = mine[mine["object"] == BLOCK]
    return sign_test(mine["hertz_reduced_modulus_pa"], mine["reduced_modulus_pa"], unit="Pa")


def displacement_nearer_to_hertz(estimates: pd.DataFrame) -> Outcome:
    """Distance of E* from Hertz's with the combined and with the displacement error."""
    mine = estimates[estimates["object"] == BLOCK]
    apart = np.log(mine["reduced_modulus_pa"] / mine["hertz_reduced_modulus_pa"]).abs()
    return _paired(mine.assign(apart=apart), "apart", "error", BOTH, DISPLACEMENT)


def kinect_farther_from_hertz(estimates: pd.DataFrame) -> Outcome:
    """Distance from Hertz's E* of the displacement error's, by sensor (Section 6.1)."""
    mine = estimates[(estimates["object"] == BLOCK) & (estimates["error"] == DISPLACEMENT)]
    apart = np.log(mine["reduced_modulus_pa"] / mine["hertz_reduced_modulus_pa"]).abs()
    return _paired(mine.assign(apart=apart), "apart", "sensor", SECOND, FIRST)


def softest_at_point_16(estimates: pd.DataFrame) -> Outcome:
    """Whether E of point 16 is the least of points 8, 16 and 17."""
    mine = estimates[(estimates["object"] == BLOCK) & estimates["point"].isin(["08", "16", "17"])]
    found = []
    for names, group in mine.groupby(["sensor", "error"]):
        E = group.set_index("point")["youngs_modulus_pa"]
        text = ", ".join(f"{point} {value:.0f} Pa" for point, value in E.items())
        found.append((" ".join(names), Outcome(text, E.idxmin() == "16" if len(E) == 3 else None)))
    return every(found)


def softest_to_stiffest(estimates: pd.DataFrame) -> Outcome:
    """Whether E grows from block over ear to ball, by error option."""
    return _objects(estimates, "youngs_modulus_pa", lambda m: m[BLOCK] < m[EAR] < m[BALL])


def ball_keeps_its_volume(estimates: pd.DataFrame) -> Outcome:
    """Whether nu of the ball is above that of the two others, by error option."""
    return _objects(estimates, "poisson_ratio", lambda m: m[BALL] > max(m[BLOCK], m[EAR]))


def ear_settles_first(settled: pd.DataFrame) -> Outcome:
    """Iteration from which the Lame parameters stay near their last values."""
    least = settled.dropna(subset=["settled_iteration"])
    least = least.groupby("object")["settled_iteration"].min()
    text = ", ".join(f"{name} {value:.0f}" for name, value in least.items())
    if not {EAR, BLOCK, BALL} <= set(least.index):
        return Outcome(text, None)
    return Outcome(text, bool(least[EAR] < min(least[BLOCK], least[BALL])))


def error_falls_little(settled: pd.DataFrame) -> Outcome:
    """Part of the first error that minimisation takes away: ear against block and ball."""
    falls = (1 - settled["error_last_mm"] / settled["error_first_mm"]).groupby(settled["object"])
    fall = falls.median().dropna()
    text = ", ".join(f"{name} by {100 * value:.1f} %" for name, value in fall.items())
    if not {EAR, BLOCK, BALL} <= set(fall.index):
        return Outcome(text, None)
    least_other = min(fall[BLOCK], fall[BALL])
    return Outcome(text, bool(fall[EAR] < CLOSE and fall[EAR] < MUCH_LESS * least_other))


def more_error_on_the_ball(settled: pd.DataFrame) -> Outcome:
    """Last error of the ball against the block's."""
    last = settled.groupby("object")["error_last_mm"].median()
    text = ", ".join(f"{name} {value:.2f} mm" for name, value in last.items())
    if not {BLOCK, BALL} <= set(last.index):
        return Outcome(text, None)
    return Outcome(text, bool(last[BALL] > last[BLOCK]))


def exact_on_exact_data(simulation: pd.DataFrame) -> Outcome:
    """Linear method on exact data, against the simulated moduli."""
    return _method(simulation, "linear_method", "exact", lambda off: max(off) < EXACT)


def whatever_the_start(starts: pd.DataFrame) -> Outcome:
    """Linear method from each start: spread of the parameters."""
    if len(starts) < 2:
        return Outcome(f"only {len(starts)} starts", None)
    spread = float((np.ptp(starts[LAME].to_numpy(), axis=0) / starts[LAME].abs().mean()).max())
    return Outcome(f"{len(starts)} starts apart by {spread:.1g}", spread < EXACT)


def fails_on_tracked_data(simulation: pd.DataFrame) -> Outcome:
    """Linear method on tracked data: far off, or not physical."""
    return _method(simulation, "linear_method", "tracked", lambda off: max(off) > FAR)


def close_on_tracked_data(simulation: pd.DataFrame) -> Outcome:
    """Displacement error minimisation on tracked data: close, and not exact."""
    check = "minimise_displacement", "tracked"
    return _method(simulation, *check, lambda off: EXACT < max(off) < CLOSE)


def minimisation_is_closer(simulation: pd.DataFrame) -> Outcome:
    """Both methods on tracked data, the worse parameter of each."""
    found = [
        _off(simulation, method, "tracked") for method in ("linear_method", "minimise_displacement")
    ]
    if None in found:
        return Outcome("not both methods", None)
    linear, searched = (max(one) for one in found)
    text = f"off by {100 * linear:.0f} % (linear) and {100 * searched:.0f} % (minimisation)"
    return Outcome(text, searched < linear)


def noise_upsets(noise: pd.DataFrame, *, error: str) -> Outcome:
    """Linear method and a minimisation with noise on exact displacements, level by level."""
    names = ["linear_method", f"minimise_{error}"]
    least, most = NOISE_M[0] * (1 - EXACT), NOISE_M[1] * (1 + EXACT)
    mine = noise[noise["noise_std_m"].between(least, most) & noise["true_lame_mu_pa"].notna()]
    off = pd.concat([(mine[f"median_{p}"] / mine[f"true_{p}"] - 1).abs() for p in LAME], axis=1)
    found = mine.assign(off=off.max(axis=1)).pivot_table(
        index="noise_std_m", columns="method", values="off"
    )
    if not set(names) <= set(found.columns) or found.index.max() < NOISE_M[1] * (1 - EXACT):
        return Outcome("no noise of the tracker's size", None)
    text = "; ".join(
        f"{1e3 * level:g} mm: off by {100 * row[names[0]]:.0f} % (linear) and"
        f" {100 * row[names[1]]:.1f} % (minimisation)"
        for level, row in found.iterrows()
    )
    return Outcome(text, bool(found[names[0]].min() > CLOSE > found[names[1]].max()))


def noisier_clouds(clouds: pd.DataFrame) -> Outcome:
    """Median distance of the Kinect's clouds from the true surface against the Bumblebee's."""
    return _paired(clouds, "value", "sensor", SECOND, FIRST, unit="mm")


def _paired(
    table: pd.DataFrame, quantity: str, over: str, larger: str, smaller: str, *, unit: str = ""
) -> Outcome:
    keys = [key for key in PLACE if key != over and key in table]
    wide = table.assign(point=table["point"].fillna("")).pivot_table(
        index=keys, columns=over, values=quantity
    )
    if not {larger, smaller} <= set(wide.columns):
        return Outcome(f"not both of {larger} and {smaller}", None)
    return sign_test(wide[larger], wide[smaller], unit=unit or UNITS.get(quantity, ""))


def _objects(estimates: pd.DataFrame, quantity: str, rule) -> Outcome:
    """Medians of the objects over the points of the sensor that captured all three."""
    mine = estimates[estimates["sensor"] == FIRST]
    found = []
    for error, group in mine.groupby("error"):
        medians = group.groupby("object")[quantity].median().dropna()
        digits, unit = DIGITS[quantity], UNITS.get(quantity, "")
        text = ", ".join(f"{name} {v:.{digits}f} {unit}".strip() for name, v in medians.items())
        there = {BLOCK, BALL, EAR} <= set(medians.index)
        found.append((error, Outcome(text, bool(rule(medians)) if there else None)))
    return every(found)


def _off(simulation: pd.DataFrame, method: str, data: str) -> list[float] | None:
    """Relative errors of both Lame parameters, where the method was tried and truth is known."""
    mine = simulation[(simulation["method"] == method) & (simulation["data"] == data)]
    if mine.empty or mine[[f"true_{name}" for name in LAME]].isna().any(axis=None):
        return None
    return [abs(float(mine[name].iloc[0] / mine[f"true_{name}"].iloc[0]) - 1) for name in LAME]


def _method(simulation: pd.DataFrame, method: str, data: str, rule) -> Outcome:
    off = _off(simulation, method, data)
    if off is None:
        return Outcome("not tried", None)
    text = f"lambda off by {100 * off[0]:.3g} %, mu by {100 * off[1]:.3g} %"
    return Outcome(text, bool(rule(off)))


E_LARGER = partial(larger_by_displacement, quantity="youngs_modulus_pa")
NU_LARGER = partial(
    where_identified, check=partial(larger_by_displacement, quantity="poisson_ratio")
)
KINECT_E_LARGER = partial(larger_by_kinect, quantity="youngs_modulus_pa")
KINECT_NU_LARGER = partial(
    where_identified, check=partial(larger_by_kinect, quantity="poisson_ratio")
)
BALL_KEEPS_ITS_VOLUME = partial(where_identified, check=ball_keeps_its_volume)
DISPLACEMENT_BEARS_NOISE = partial(noise_upsets, error=DISPLACEMENT)
BOTH_BEAR_NOISE = partial(noise_upsets, error=BOTH)
