"""Computations behind the study's findings; each can come out either way."""

from collections.abc import Callable

import numpy as np
import pandas as pd
from palpate.units import PERCENT

from thesis.findings.printed import BALL, BLOCK, EAR
from thesis.findings.verdicts import Outcome, each, follow, rank_test, sign_test, trend_test

FIRST, SECOND = "bumblebee", "kinect"
DISPLACEMENT, BOTH = "displacement", "force_displacement"
# Table 5.1's deviation is 8.7 % of its mean: less than that between places is no pattern.
LEAST_PATTERN = 1.09
MIDDLE_ROW, MIDDLE_COLUMNS = 2, (2, 5)
SPREAD = 0.10
EXACT, CLOSE, FAR = 1e-3, 0.10, 0.5
MUCH_LESS = 0.5
# The tracker errs by 0.3 to 0.7 mm: noise of 0.1 to 1 mm encloses that.
NOISE_M = 1e-4, 1e-3
# Deviations of one traced path each closer than this are the same.
STEADIER = 1.1
# Part of its volume that a surface must lose to have shrunk.
SHRUNK = 0.01
NU, VERDICT, IDENTIFIED = "poisson_ratio", "poisson_ratio_verdict", "identified"
LAME = ["lame_lambda_pa", "lame_mu_pa"]
Check = Callable[[pd.DataFrame], Outcome]
PLACE, OBJECTS = ["object", "sensor", "point", "error"], (BLOCK, BALL, EAR)


def check_of(text: str) -> Check:
    """The check that findings.yaml names: a function of this module and its arguments."""
    name, *arguments = text.split()
    return lambda table: globals()[name](table, *arguments)


def stiffer_in_the_middle(points: pd.DataFrame) -> Outcome:
    """Hertz's E* of the inner points of the middle row against all others, by sensor."""

    def test(mine: pd.DataFrame) -> Outcome:
        inner = mine["row"].eq(MIDDLE_ROW) & mine["column"].between(*MIDDLE_COLUMNS)
        values = mine["reduced_modulus_pa"]
        return rank_test(values[inner], values[~inner], least_ratio=LEAST_PATTERN)

    return each(points.groupby("sensor"), test)


def repeatable(repeats: pd.DataFrame) -> Outcome:
    """Relative standard deviation of the attempts at one point."""
    values = repeats["reduced_modulus_pa"].to_numpy(float)
    if len(values) < 3:
        return Outcome(f"only {len(values)} attempts", None)
    spread = values.std(ddof=1) / values.mean()
    text = f"{100 * spread:.1f} % of the mean over {len(values)} attempts"
    return Outcome(text, bool(spread < SPREAD))


def larger_by_displacement(estimates: pd.DataFrame, quantity: str) -> Outcome:
    """The displacement error's value against the combined error's, capture by capture."""
    return _paired(estimates, quantity, "error", DISPLACEMENT, BOTH)


def larger_by_kinect(estimates: pd.DataFrame, quantity: str) -> Outcome:
    """The Kinect's value against the Bumblebee's: means of both error options, by point."""
    keys = ["object", "sensor", "point"]
    table = estimates.assign(point=estimates["point"].fillna(""))
    # A place without one of the options has no mean.
    means = table.pivot_table(index=keys, columns="error", values=quantity, dropna=False)
    means = means.reindex(columns=[DISPLACEMENT, BOTH]).mean(axis=1, skipna=False)
    return _paired(means.rename(quantity).reset_index(), quantity, "sensor", SECOND, FIRST)


def where_identified(estimates: pd.DataFrame, *words: str) -> Outcome:
    """A check on nu, of the minima alone whose own verdict is that they identify it.

    A printed nu has no verdict and counts as it is.
    """
    check = check_of(" ".join(words))
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
    mine = estimates[(estimates["object"] == BLOCK) & (estimates["error"] == BOTH)]
    return sign_test(mine["hertz_reduced_modulus_pa"], mine["reduced_modulus_pa"], unit="Pa")


def displacement_nearer_to_hertz(estimates: pd.DataFrame) -> Outcome:
    """Distance of E* from Hertz's with the combined and with the displacement error."""
    return _paired(_off_hertz(estimates), "apart", "error", BOTH, DISPLACEMENT)


def kinect_farther_from_hertz(estimates: pd.DataFrame) -> Outcome:
    """Distance from Hertz's E* of the displacement error's, by sensor (Section 6.1)."""
    mine = _off_hertz(estimates[estimates["error"] == DISPLACEMENT])
    return _paired(mine, "apart", "sensor", SECOND, FIRST)


def _off_hertz(estimates: pd.DataFrame) -> pd.DataFrame:
    """Rows of the block with how far E* is from Hertz's, as a logarithm."""
    mine = estimates[estimates["object"] == BLOCK]
    apart = np.log(mine["reduced_modulus_pa"] / mine["hertz_reduced_modulus_pa"]).abs()
    return mine.assign(apart=apart)


def softest_at_point_16(estimates: pd.DataFrame) -> Outcome:
    """Whether E of point 16 is the least of points 8, 16 and 17."""
    points = ["08", "16", "17"]
    mine = estimates[(estimates["object"] == BLOCK) & estimates["point"].isin(points)]
    places = mine.set_index("point").groupby(["sensor", "error"])["youngs_modulus_pa"]

    def softest(E: pd.Series) -> Outcome:
        return follow(E, lambda E: E.idxmin() == "16", "{} {:.0f} Pa", points)

    return each(places, softest)


def softest_to_stiffest(estimates: pd.DataFrame) -> Outcome:
    """Whether E grows from block over ear to ball, by error option."""
    return _objects(
        estimates, "youngs_modulus_pa", lambda E: E[BLOCK] < E[EAR] < E[BALL], "{} {:.0f} Pa"
    )


def ball_keeps_its_volume(estimates: pd.DataFrame) -> Outcome:
    """Whether nu of the ball is above that of the two others, by error option."""
    return _objects(estimates, NU, lambda nu: nu[BALL] > max(nu[BLOCK], nu[EAR]), "{} {:.3f}")


def ear_settles_first(settled: pd.DataFrame) -> Outcome:
    """Iteration from which the Lame parameters stay near their last values."""
    found = settled.dropna(subset=["settled_iteration"])
    least = found.groupby("object")["settled_iteration"].min()
    return follow(least, lambda k: k[EAR] < min(k[BLOCK], k[BALL]), "{} {:.0f}", OBJECTS)


def error_falls_little(settled: pd.DataFrame) -> Outcome:
    """Part of the first error that minimisation takes away: ear against block and ball."""
    falls = 1 - settled["error_last_mm"] / settled["error_first_mm"]
    fall = PERCENT * falls.groupby(settled["object"]).median().dropna()

    def little(fall: pd.Series) -> bool:
        much = min(fall[BLOCK], fall[BALL])
        return fall[EAR] < PERCENT * CLOSE and fall[EAR] < MUCH_LESS * much

    return follow(fall, little, "{} by {:.1f} %", OBJECTS)


def more_error_on_the_ball(settled: pd.DataFrame) -> Outcome:
    """Last error of the ball against the block's."""
    last = settled.groupby("object")["error_last_mm"].median()
    return follow(last, lambda mm: mm[BALL] > mm[BLOCK], "{} {:.2f} mm", (BLOCK, BALL))


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
    methods = "linear_method", "minimise_displacement"
    found = [_off(simulation, method, "tracked") for method in methods]
    if None in found:
        return Outcome("not both methods", None)
    linear, searched = (max(one) for one in found)
    text = f"off by {100 * linear:.0f} % (linear) and {100 * searched:.0f} % (minimisation)"
    return Outcome(text, searched < linear)


def noise_upsets(noise: pd.DataFrame, error: str) -> Outcome:
    """Linear method and a minimisation with noise on exact displacements, level by level."""
    names = ["linear_method", f"minimise_{error}"]
    least, most = NOISE_M[0] * (1 - EXACT), NOISE_M[1] * (1 + EXACT)
    mine = noise[noise["noise_std_m"].between(least, most) & noise["true_lame_mu_pa"].notna()]
    off = pd.concat([(mine[f"median_{p}"] / mine[f"true_{p}"] - 1).abs() for p in LAME], axis=1)
    mine = mine.assign(off=off.max(axis=1))
    found = mine.pivot_table(index="noise_std_m", columns="method", values="off")
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


def deepest_axis_worst(tip: pd.DataFrame) -> Outcome:
    """Scatter of the resting tip along the camera's axis against the other two."""

    def test(std: pd.Series) -> Outcome:
        return follow(std, lambda s: s["z"] > max(s["x"], s["y"]), "{} {:.4f} cm", "xyz")

    return each(tip.set_index("axis").groupby("sensor")["std_cm"], test)


def grows_with_distance(workspace: pd.DataFrame) -> Outcome:
    """Scatter along the camera's axis against the tip's distance, over the points."""
    mine = workspace[workspace["selected"]]
    return each(mine.groupby("sensor"), lambda one: trend_test(one["mean_z_m"], one["std_z_m"]))


def low_threshold_scatters(workspace: pd.DataFrame) -> Outcome:
    """Scatter at the least threshold against that at the selected one, point by point."""

    def test(mine: pd.DataFrame) -> Outcome:
        least = mine["threshold_px"] == mine["threshold_px"].min()
        return _by_point(mine, "std_z_m", least, mine["selected"], "m")

    return each(workspace.groupby("sensor"), test)


def higher_threshold_more(workspace: pd.DataFrame, quantity: str) -> Outcome:
    """Mean over the workspace against the threshold."""
    means = workspace.groupby(["sensor", "threshold_px"])[quantity].mean().reset_index()
    return each(means.groupby("sensor"), lambda one: trend_test(one["threshold_px"], one[quantity]))


def angle_least_inside(workspace: pd.DataFrame) -> Outcome:
    """Scatter of the normal's angle at the highest threshold against that at the printed one."""

    def test(mine: pd.DataFrame) -> Outcome:
        threshold = mine["threshold_px"]
        printed = np.isclose(threshold, mine["published_px"])
        found = _by_point(mine, "std_angle_rad", threshold == threshold.max(), printed, "rad")
        least = mine["std_angle_rad"].groupby(threshold).mean().idxmin()
        return Outcome(f"least mean at {least:g} px; {found.evidence}", found.holds)

    return each(workspace.groupby("sensor"), test)


def steadier_tracing(case: pd.DataFrame) -> Outcome:
    """Deviation of the offset of the path from the CD case, as the study's filter gives it."""

    def steadier(std: pd.Series) -> bool | None:
        one, other = std[FIRST], std[SECOND]
        return one < other if max(one, other) >= STEADIER * min(one, other) else None

    std = case.set_index("sensor")["study_offset_std_mm"]
    return follow(std, steadier, "{} {:.2f} mm", (FIRST, SECOND))


def one_view_shrinks(volumes: pd.DataFrame) -> Outcome:
    """Volume of the ball tracked from one view and from turned clouds, most pressed frame."""

    def shrinks(mine: pd.DataFrame) -> Outcome:
        one, turned = mine[["one_view_change", "turned_change"]].iloc[0]
        text = f"{100 * one:+.1f} % from one view, {100 * turned:+.1f} % from turned clouds"
        shrunk, more = one <= -SHRUNK, turned - one >= SHRUNK
        return Outcome(text, True if shrunk and more else False if not shrunk else None)

    return each(volumes.groupby("sensor"), shrinks)


def _by_point(table: pd.DataFrame, quantity: str, one: pd.Series, other: pd.Series, unit: str):
    """Sign test, point by point, of a quantity in some rows against others."""
    both = [table[part].set_index("point")[quantity] for part in (one, other)]
    return sign_test(*both[0].align(both[1], join="inner"), what="points", unit=unit)


def _paired(
    table: pd.DataFrame, quantity: str, over: str, larger: str, smaller: str, *, unit: str = ""
) -> Outcome:
    keys = [key for key in PLACE if key != over and key in table]
    table = table.assign(point=table["point"].fillna(""))
    wide = table.pivot_table(index=keys, columns=over, values=quantity)
    if not {larger, smaller} <= set(wide.columns):
        return Outcome(f"not both of {larger} and {smaller}", None)
    return sign_test(wide[larger], wide[smaller], unit=unit or "Pa" * quantity.endswith("_pa"))


def _objects(estimates: pd.DataFrame, quantity: str, rule: Callable, form: str) -> Outcome:
    """Medians of the objects over the points of the sensor that captured all three."""
    mine = estimates[estimates["sensor"] == FIRST]
    medians = mine.groupby(["error", "object"])[quantity].median().dropna()
    return each(
        medians.groupby("error"), lambda one: follow(one.droplevel("error"), rule, form, OBJECTS)
    )


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
