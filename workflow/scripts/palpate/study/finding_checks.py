"""Computations behind the study's findings; each can come out either way."""

from functools import partial

import numpy as np
import pandas as pd

from palpate.study.printed import BALL, BLOCK, EAR
from palpate.study.verdicts import Outcome, every, rank_test, sign_test, trend_test

DISPLACEMENT, BOTH = "displacement", "force_displacement"
FIRST, SECOND = "bumblebee", "kinect"
# Table 5.1's deviation is 8.7 % of its mean: less than that between places is no pattern.
LEAST_PATTERN = 1.09
MIDDLE_ROW, MIDDLE_COLUMNS = 2, (2, 5)
SPREAD = 0.10
EXACT, CLOSE, FAR = 1e-3, 0.10, 0.5
NOISE_M = 1e-4
# Decimals of moduli [Pa] and ratios in the evidence.
DIGITS = {"youngs_modulus_pa": 0, "poisson_ratio": 3}
LAME = ["lame_lambda_pa", "lame_mu_pa"]
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
    """The Kinect's value against the Bumblebee's, by object, point and error option."""
    return _paired(estimates, quantity, "sensor", SECOND, FIRST)


def below_hertz(estimates: pd.DataFrame) -> Outcome:
    """The combined error's E* against Hertz's."""
    mine = estimates[estimates["error"] == BOTH]
    mine = mine[mine["object"] == BLOCK]
    return sign_test(mine["hertz_reduced_modulus_pa"], mine["reduced_modulus_pa"])


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
    """Part of the first error that the ear's minimisation takes away: less than a tenth."""
    mine = settled[settled["object"] == EAR]
    if mine.empty:
        return Outcome("no ear", None)
    fall = 1 - float((mine["error_last_mm"] / mine["error_first_mm"]).iloc[0])
    return Outcome(f"falls by {100 * fall:.1f} %", fall < CLOSE)


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


def linear_method_upset_by_noise(noise: pd.DataFrame) -> Outcome:
    """Both methods with noise of 0.1 mm on exact displacements."""
    mine = noise[np.isclose(noise["noise_std_m"], NOISE_M)].set_index("method")
    names = ["linear_method", "minimise_displacement"]
    if mine["true_lame_mu_pa"].isna().any() or not set(names) <= set(mine.index):
        return Outcome("no such noise", None)
    off = [
        max(abs(mine.loc[name, f"median_{p}"] / mine.loc[name, f"true_{p}"] - 1) for p in LAME)
        for name in names
    ]
    text = f"off by {100 * off[0]:.0f} % (linear) and {100 * off[1]:.1f} % (minimisation)"
    return Outcome(text, bool(off[0] > CLOSE > off[1]))


def deepest_axis_worst(tip: pd.DataFrame) -> Outcome:
    """Scatter of the resting tip along the camera's axis against the other two."""
    found = []
    for sensor, group in tip.groupby("sensor"):
        std = group.set_index("axis")["std_cm"]
        text = ", ".join(f"{axis} {value:.4f} cm" for axis, value in std.items())
        found.append((sensor, Outcome(text, bool(std["z"] > max(std["x"], std["y"])))))
    return every(found)


def grows_with_distance(workspace: pd.DataFrame) -> Outcome:
    """Scatter along the camera's axis against the tip's distance, over the points."""
    mine = workspace[workspace["selected"]]
    return _each_sensor(mine, lambda one: trend_test(one["mean_z_m"], one["std_z_m"]))


def low_threshold_scatters(workspace: pd.DataFrame) -> Outcome:
    """Scatter at the least threshold against that at the selected one, point by point."""
    least = workspace["threshold_px"] == workspace["threshold_px"].min()
    rows = [*_pairing(workspace, least, workspace["selected"], "std_z_m")]
    return every([(sensor, sign_test(a, b, what="points")) for sensor, a, b in rows])


def higher_threshold_more(workspace: pd.DataFrame, *, quantity: str) -> Outcome:
    """Mean over the workspace against the threshold."""
    means = workspace.groupby(["sensor", "threshold_px"])[quantity].mean().reset_index()
    return _each_sensor(means, lambda one: trend_test(one["threshold_px"], one[quantity]))


def noisier_clouds(clouds: pd.DataFrame) -> Outcome:
    """Median distance of the Kinect's clouds from the true surface against the Bumblebee's."""
    return _paired(clouds, "value", "sensor", SECOND, FIRST)


def steadier_tracing(case: pd.DataFrame) -> Outcome:
    """Deviation of the traced path's offset from the CD case."""
    std = case.set_index("sensor")["smooth_offset_std_mm"]
    text = ", ".join(f"{sensor} {value:.2f} mm" for sensor, value in std.items())
    if not {FIRST, SECOND} <= set(std.index):
        return Outcome(text, None)
    return Outcome(text, bool(std[FIRST] < std[SECOND]))


def _paired(table: pd.DataFrame, quantity: str, over: str, larger: str, smaller: str) -> Outcome:
    keys = [key for key in PLACE if key != over and key in table]
    wide = table.assign(point=table["point"].fillna("")).pivot_table(
        index=keys, columns=over, values=quantity
    )
    if not {larger, smaller} <= set(wide.columns):
        return Outcome(f"not both of {larger} and {smaller}", None)
    return sign_test(wide[larger], wide[smaller])


def _objects(estimates: pd.DataFrame, quantity: str, rule) -> Outcome:
    """Medians of the objects over the points of the sensor that captured all three."""
    mine = estimates[estimates["sensor"] == FIRST]
    found = []
    for error, group in mine.groupby("error"):
        medians = group.groupby("object")[quantity].median()
        text = ", ".join(f"{name} {value:.{DIGITS[quantity]}f}" for name, value in medians.items())
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


def _each_sensor(table: pd.DataFrame, check) -> Outcome:
    return every([(sensor, check(group)) for sensor, group in table.groupby("sensor")])


def _pairing(table: pd.DataFrame, one: pd.Series, other: pd.Series, quantity: str):
    for sensor in sorted(table["sensor"].unique()):
        mine = table["sensor"] == sensor
        both = [table[mine & part].set_index("point")[quantity] for part in (one, other)]
        yield sensor, *both[0].align(both[1], join="inner")


E_LARGER = partial(larger_by_displacement, quantity="youngs_modulus_pa")
NU_LARGER = partial(larger_by_displacement, quantity="poisson_ratio")
KINECT_E_LARGER = partial(larger_by_kinect, quantity="youngs_modulus_pa")
KINECT_NU_LARGER = partial(larger_by_kinect, quantity="poisson_ratio")
MORE_INLIERS = partial(higher_threshold_more, quantity="inliers")
MORE_REPROJECTION = partial(higher_threshold_more, quantity="reprojection_error_px2")
