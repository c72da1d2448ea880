"""Figures of a direct estimate: what was seen and computed, and what of it is known."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from palpate.estimate.direct.estimate import DirectEstimate
from palpate.estimate.direct.quantities import ONE_SECOND_S
from palpate.estimate.direct.result import CaptureFit, load_fitted
from palpate.estimate.relaxation import relaxed_share
from palpate.json_fields import read_all
from palpate.modulus import CONFIDENCE, LABELS
from palpate.report import style
from palpate.report.held import seconds_compared
from palpate.report.own_words import LAWS
from palpate.units import KILOPASCALS, MILLIMETRES

ROW_IN, KNOWN_IN = 3.0, 2.6
# Motions beyond these percentiles, and this part of the range more, are outside of the panel.
WITHIN, MARGIN = (1.0, 99.0), 0.25
# Distances between which a band of the motions' noise is drawn.
RINGS = 16
BAND = {"color": to_rgba(style.GREY, 0.25), "lw": 0}
OUTSIDE = {"va": "top", "fontsize": 6.5, "color": style.GREY}
REGIONS = {
    "force": (style.BLUE, "depth alone"),
    "surface": (style.ORANGE, "surface alone"),
    "both": (style.GREEN, "both"),
}
# Of the plane of nu and E, each way from the estimate.
WIDER, STEPS, GREATEST_NU = 2.0, 201, 0.5
# Times of the relaxing modulus that are drawn [s].
FROM_S, TO_S = 0.03, 30.0


def make_fit(inputs: Any, params: Any) -> Figure:
    """Force and motion, seen and computed, of each sensor's captures together."""
    titles = [f"{style.sensor_name(group['sensor'])}: force" for group in params.groups]
    found = fits(titles, map(load_fitted, inputs.fitted))
    return style.finished(found, {capture["provenance"] for capture in params.captures})


def make_known(inputs: Any, params: Any) -> Figure:
    """What of E, nu, the law and relaxation is known, of each sensor's captures together."""
    ends_s = [
        max(seconds_compared(one.time_s, one.tip_depth_m, one.frames) for one in fitted.values())
        for fitted in map(load_fitted, inputs.fitted)
    ]
    found = known([g["sensor"] for g in params.groups], read_all(inputs.joint), ends_s)
    return style.finished(found, {capture["provenance"] for capture in params.captures})


def figure_of_estimates(estimates: Sequence[tuple[str, DirectEstimate]]) -> Figure:
    """Draw `fits` of estimates with their titles, and E and nu above them."""
    with style.journal():
        moduli = ("youngs_modulus_pa", "poisson_ratio")
        titles = [
            "\n".join([title, *(f"{LABELS[name]} {found.moduli[name]}" for name in moduli)])
            for title, found in estimates
        ]
        fitted = [dict(enumerate(found.captures())) for _, found in estimates]
        return style.finished(fits(titles, fitted), set())


def fits(titles: Sequence[str], fitted: Iterable[Mapping[Any, CaptureFit]]) -> Figure:
    """Force against depth and motion against distance, with what the estimate leaves of both.

    A row for each title and captures by name (`load_fitted`).
    """
    count = len(titles)
    figure = plt.figure(figsize=(style.PAGE_IN, ROW_IN * count))
    for row, title, captures in zip(figure.add_gridspec(count, 1), titles, fitted, strict=True):
        panels = row.subgridspec(2, 2, height_ratios=(2.2, 1), hspace=0.15, wspace=0.25).subplots()
        (force, motion), (force_left, motion_left) = panels
        _force(force, force_left, captures)
        _motion(motion, motion_left, captures)
        force.set_title(title)
        motion.set_title("surface displacement, maximum depth")
    return figure


def known(sensors: Sequence[str], estimates: Sequence[Mapping], ends_s: Sequence[float]) -> Figure:
    """Plane of nu and E, place among the laws, and E over time.

    By sensor, of the direct.json of each and how long after the touch its captures were compared
    [s].
    """
    count = len(sensors)
    figure, axes = plt.subplots(count, 3, figsize=(style.PAGE_IN, KNOWN_IN * count), squeeze=False)
    rows = zip(axes, sensors, estimates, ends_s, strict=True)
    for (plane, law, over_time), sensor, found, end_s in rows:
        _regions(plane, found)
        _law(law, found["law"]["force"])
        _relaxing(over_time, found, end_s)
        plane.set_title(f"{style.sensor_name(sensor)}: E and nu")
        law.set_title("material law")
        over_time.set_title("E over time")
    return figure


def _force(axes: Axes, left: Axes, captures: Mapping[str, CaptureFit]) -> None:
    for one in captures.values():
        order = np.argsort(one.fitted_depth_m)
        seen, told = MILLIMETRES * one.depth_m, MILLIMETRES * one.fitted_depth_m
        axes.plot(seen, one.force_n, "o", ms=3, color=style.GREY)
        axes.plot(told[order], one.force_n[order], lw=0.9, color=style.ORANGE)
        gap = MILLIMETRES * (one.depth_m - one.fitted_depth_m)
        _band(left, seen, MILLIMETRES * one.depth_expected_std_m)
        left.plot(seen, gap, "o-", ms=3, lw=0.6, color=style.GREY)
    axes.set_ylabel("force (N)")
    _below(axes, left, "depth (mm)")


def _motion(axes: Axes, left: Axes, captures: Mapping[str, CaptureFit]) -> None:
    drawn = []
    for one in captures.values():
        frame, away = int(np.argmax(one.depth_m)), MILLIMETRES * one.distance_m
        seen, told = (MILLIMETRES * m[frame] for m in (one.moved_m, one.fitted_moved_m))
        axes.plot(away, seen, ".", ms=3, color=style.GREY)
        axes.plot(away, told, ".", ms=2, color=style.ORANGE)
        _band(left, *_by_ring(away, MILLIMETRES * one.moved_expected_std_m[frame]))
        left.plot(away, seen - told, ".", ms=2.5, color=style.GREY)
        drawn.append((seen, told))
    seen, told = (np.concatenate(each) for each in zip(*drawn, strict=True))
    _zoom(axes, seen, told)
    _zoom(left, seen - told, np.zeros(1))
    axes.set_ylabel("outward (mm)")
    _below(axes, left, "distance from the contact (mm)")


def _by_ring(away: NDArray, std: NDArray) -> tuple[NDArray, NDArray]:
    """Distances, and the root mean square of the deviations of what is as far, (r,) each."""
    seen = pd.DataFrame({"away": away, "variance": std**2}).dropna()
    ring = pd.qcut(seen["away"], RINGS, labels=False, duplicates="drop") if len(seen) else []
    means = seen.groupby(ring).mean()
    return means["away"].to_numpy(), np.sqrt(means["variance"].to_numpy())


def _band(axes: Axes, place: NDArray, std: NDArray) -> None:
    """Where 95 of 100 residuals are expected."""
    order, wide = np.argsort(place), norm.ppf((1 + CONFIDENCE) / 2)
    axes.fill_between(place[order], -wide * std[order], wide * std[order], **BAND)


def _zoom(axes: Axes, seen: NDArray, told: NDArray) -> None:
    """Leave single values far from all others outside, and say how many."""
    seen, told = seen[np.isfinite(seen)], told[np.isfinite(told)]
    if not len(seen):
        return
    low, high = np.percentile(seen, WITHIN)
    low, high = min(low, told.min()), max(high, told.max())
    margin = MARGIN * max(high - low, 1e-9)
    axes.set_ylim(low - margin, high + margin)
    beyond = int(((seen < low - margin) | (seen > high + margin)).sum())
    if beyond:
        axes.text(1, 1, f"{beyond} outside", transform=axes.transAxes, ha="right", **OUTSIDE)


def _below(axes: Axes, left: Axes, label: str) -> None:
    """Put what is left under what it is left of, on one axis."""
    left.axhline(0, color=style.BLACK, lw=0.6)
    left.set(xlabel=label, ylabel="residual (mm)", xlim=axes.get_xlim())
    axes.tick_params(labelbottom=False)
    # The first two lines; those of further captures look alike.
    axes.legend(["measured", "computed"])


def _regions(axes: Axes, found: Mapping) -> None:
    """What the force, the surface and both leave of nu and E, at 95 %."""
    E, nu = (found[name]["value"] for name in ("youngs_modulus_pa", "poisson_ratio"))
    ratios = np.linspace(0, GREATEST_NU, STEPS)
    logs = np.linspace(-np.log(WIDER), np.log(WIDER), STEPS)
    off = np.stack(np.broadcast_arrays(logs[:, None], ratios[None] - nu), axis=-1)
    most = float(chi2.ppf(CONFIDENCE, 2))
    moduli = KILOPASCALS * E * np.exp(logs)
    for name, (colour, _) in REGIONS.items():
        told = np.einsum("abi,ij,abj->ab", off, np.array(found["regions"][name]), off)
        axes.contourf(ratios, moduli, told, [-1, most], colors=[to_rgba(colour, 0.25)])
        axes.contour(ratios, moduli, told, [most], colors=[colour], linewidths=0.9)
    axes.plot(nu, KILOPASCALS * E, "+", color=style.BLACK, ms=6)
    axes.set(xlabel="nu", ylabel="E (kPa)", xlim=(0, GREATEST_NU), ylim=(moduli[0], moduli[-1]))
    patches = [Patch(color=to_rgba(colour, 0.5), label=label) for colour, label in REGIONS.values()]
    axes.legend(handles=patches, fontsize=6.5, loc="upper left", handlelength=1.0)


def _law(axes: Axes, law: Mapping) -> None:
    """How likely each place among the laws is."""
    reach = max(abs(law["value"] - 0.5) + 3 * law["std"], 1.2)
    place = np.linspace(0.5 - reach, 0.5 + reach, STEPS)
    likely = norm.pdf(place, law["value"], law["std"]) * law["std"]
    axes.fill_between(place, likely, color=to_rgba(style.GREEN, 0.35), lw=0)
    axes.plot(place, likely, color=style.GREEN, lw=0.9)
    for at, name in LAWS.items():
        axes.axvline(at, color=style.BLACK, lw=0.8, ls="--")
        side = "right" if at < 0.5 else "left"
        axes.annotate(" " + name.removesuffix("'s") + " ", (at, 0.46), ha=side, fontsize=6.5)
    axes.set(xlabel="material-law parameter", ylabel="how likely", ylim=(0, 0.52), yticks=[])


def _relaxing(axes: Axes, found: Mapping, end_s: float) -> None:
    """What is left of E a time after a step, with the intervals at the step and after 1 s.

    Dashed, and hollow, is what is later than the captures.
    """
    time = np.sort(np.append(np.geomspace(FROM_S, TO_S, STEPS), end_s))
    lost = relaxed_share(
        time, fractions=found["relaxation"]["fractions"], times_s=found["relaxation"]["times_s"]
    )
    left = KILOPASCALS * found["youngs_modulus_pa"]["value"] * (1 - lost)
    for part, line in ((time <= end_s, "-"), (time >= end_s, "--")):
        axes.plot(time[part], left[part], line, color=style.BLUE)
    told = {FROM_S: "", ONE_SECOND_S: "_1s"}
    for at, end in told.items():
        one = found[f"youngs_modulus{end}_pa"]
        low, value, high = (KILOPASCALS * one[name] for name in ("low", "value", "high"))
        look = {"fmt": "o", "ms": 3, "lw": 0.9, "color": style.BLUE}
        look |= {"mfc": "white"} if at > end_s else {}
        axes.errorbar(at, value, [[value - low], [high - value]], **look)
    axes.set(xscale="log", xlabel="time after a step (s)", ylabel="E (kPa)")
    axes.set_ylim(bottom=0)
