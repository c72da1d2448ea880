"""Computations behind the study's findings on sensors and tracking."""

from functools import partial

import numpy as np
import pandas as pd

from thesis.findings.verdicts import Outcome, every, sign_test, trend_test

FIRST, SECOND = "bumblebee", "kinect"
# Deviations of one traced path each closer than this are the same.
STEADIER = 1.1
# Part of its volume that a surface must lose to have shrunk.
SHRUNK = 0.01


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
    return every([(sensor, sign_test(a, b, what="points", unit="m")) for sensor, a, b in rows])


def higher_threshold_more(workspace: pd.DataFrame, *, quantity: str) -> Outcome:
    """Mean over the workspace against the threshold."""
    means = workspace.groupby(["sensor", "threshold_px"])[quantity].mean().reset_index()
    return _each_sensor(means, lambda one: trend_test(one["threshold_px"], one[quantity]))


def angle_least_inside(workspace: pd.DataFrame) -> Outcome:
    """Scatter of the normal's angle at the highest threshold against that at the printed one."""
    highest = workspace["threshold_px"] == workspace["threshold_px"].max()
    printed = np.isclose(workspace["threshold_px"], workspace["published_px"])
    found = []
    for sensor, a, b in _pairing(workspace, highest, printed, "std_angle_rad"):
        mine = workspace[workspace["sensor"] == sensor]
        means = mine.groupby("threshold_px")["std_angle_rad"].mean()
        test = sign_test(a, b, what="points", unit="rad")
        found.append(
            (sensor, Outcome(f"least mean at {means.idxmin():g} px; {test.evidence}", test.holds))
        )
    return every(found)


def steadier_tracing(case: pd.DataFrame) -> Outcome:
    """Deviation of the offset of the path from the CD case, as the study's filter gives it."""
    std = case.set_index("sensor")["study_offset_std_mm"]
    text = ", ".join(f"{sensor} {value:.2f} mm" for sensor, value in std.items())
    if not {FIRST, SECOND} <= set(std.index):
        return Outcome(text, None)
    one, other = float(std[FIRST]), float(std[SECOND])
    apart = max(one, other) >= STEADIER * min(one, other)
    return Outcome(text, one < other if apart else None)


def one_view_shrinks(volumes: pd.DataFrame) -> Outcome:
    """Volume of the ball tracked from one view and from turned clouds, most pressed frame."""
    found = []
    for row in volumes.to_dict("records"):
        one, turned = row["one_view_change"], row["turned_change"]
        text = f"{100 * one:+.1f} % from one view, {100 * turned:+.1f} % from turned clouds"
        shrunk, more = one <= -SHRUNK, turned - one >= SHRUNK
        holds = True if shrunk and more else False if not shrunk else None
        found.append((row["sensor"], Outcome(text, holds)))
    return every(found)


def _each_sensor(table: pd.DataFrame, check) -> Outcome:
    return every([(sensor, check(group)) for sensor, group in table.groupby("sensor")])


def _pairing(table: pd.DataFrame, one: pd.Series, other: pd.Series, quantity: str):
    for sensor in sorted(table["sensor"].unique()):
        mine = table["sensor"] == sensor
        both = [table[mine & part].set_index("point")[quantity] for part in (one, other)]
        yield sensor, *both[0].align(both[1], join="inner")


MORE_INLIERS = partial(higher_threshold_more, quantity="inliers")
MORE_REPROJECTION = partial(higher_threshold_more, quantity="reprojection_error_px2")
