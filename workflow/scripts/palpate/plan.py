"""What captures are going to determine: the estimate's own uncertainty budget, before them.

Captures are drawn up from an indentation table, a guess of E and the rig's noise, and the budget is
that of such captures. A ball of another radius is taken as on a half-space.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import stdtrit

from palpate import modulus
from palpate.capture.tables import columns_of
from palpate.estimate.direct import indentation as unknown
from palpate.estimate.direct.budget import Budget, budget_of
from palpate.estimate.direct.deviations import Scales, scales_of, with_depth_errors, with_pattern
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import DirectIndentation, linearised
from palpate.estimate.direct.motion import SurfaceMotion
from palpate.estimate.direct.options import Fit, Observation, ProbeUncertainty
from palpate.estimate.direct.quantities import POISSON, over_star, over_star_by_nu, quantities_of
from palpate.estimate.direct.table import axes_across
from palpate.estimate.hertz.indentation import FEWEST_AT_REST
from palpate.noise import ELEVATION, Noise
from palpate.planned_captures import PlannedCaptures, Protocol
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.options import greatest_ratio
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from palpate.surface.template import Template
from palpate.units import MILLIMETRES, PERCENT
from palpate.vision.force import FORCE
from palpate.vision.probe import ALONG_STD

NU = "poisson_ratio"
# Of the greatest force: frames before it are at rest.
AT_REST = 0.03
# After a run: so many more captures; a ball so much larger; a table this much deeper is a change.
MORE, LARGER, DEEPER = 3, 1.4, 1.1
# As captures of the default objects show them: depths err by this multiple of what is likely.
DEPTH_PATTERN = 2.0
# Noises that are drawn, and steps along nu.
DRAWS, STEPS = 4, 201


@dataclass(frozen=True)
class Forecast:
    """What captures by a protocol are expected to determine.

    Attributes
    ----------
    protocol : Protocol
    half_width : dict of str to float
        Of the intervals (95 %) by `modulus.LABELS`: as parts of moduli, and of nu itself.
    verdict : dict of str to str
        Of `modulus.VERDICTS`.
    limit : dict of str to str
        Source of error that adds most to each.
    """

    protocol: Protocol
    half_width: dict[str, float]
    verdict: dict[str, str]
    limit: dict[str, str]

    def to_dict(self) -> dict:
        """For a JSON file."""
        protocol = vars(self.protocol) | {"camera_m": self.protocol.camera_m.tolist()}
        return vars(self) | {"protocol": protocol}

    @staticmethod
    def of(
        protocol: Protocol, budget: Budget, with_nu: NDArray, nu: float, bounds: tuple[float, float]
    ) -> "Forecast":
        """Intervals by a budget and covariances with nu (7,) of the fit, about a guess of nu."""
        t = stdtrit(budget.freedom, (1 + modulus.CONFIDENCE) / 2)
        half, nu_std = t[POISSON] * budget.std[POISSON], np.sqrt(with_nu[POISSON])
        low, high = np.clip([nu - half, nu + half], *bounds)
        slope = with_nu / with_nu[POISSON]
        rest = np.maximum(budget.std**2 - slope * with_nu, 0.0)
        # As `quantities.intervals` has them: along nu as far as its range goes.
        ends = np.clip(nu + np.array([-1.0, 1.0]) * t.min() * nu_std, *bounds) - nu
        away = np.linspace(*ends, STEPS)[:, None]
        left = np.maximum(1 - (away / (t * nu_std)) ** 2, 0.0)
        logs = (slope - over_star_by_nu(nu)) * away
        logs = logs + over_star(nu + away[:, 0]).T - over_star(nu)
        reach = t * np.sqrt(rest * left)
        below, above = (logs - reach).min(axis=0), (logs + reach).max(axis=0)
        widths, verdicts, limits = {}, {}, {}
        for k, name in enumerate(modulus.LABELS):
            interval = float(np.exp(below[k])), float(np.exp(above[k]))
            widths[name] = (interval[1] - interval[0]) / 2
            verdicts[name] = modulus.Modulus.of_pascals(1.0, *interval).verdict
            limits[name] = max((one.contributions[k], one.name) for one in budget.sources)[1]
        widths[NU], verdicts[NU] = float(high - low) / 2, modulus.verdict_of_nu(low, high, bounds)
        return Forecast(protocol, widths, verdicts, limits)


class Planned(PlannedCaptures):
    """An object, a rig and a guess of the moduli: what captures are going to determine.

    Examples
    --------
    >>> from palpate import IndentationTable, indentation_table, measure, open_capture, solid_of
    >>> folder = "tests/sample/raw/foam_block/kinect/08"
    >>> measured = measure(open_capture(folder, sensors="tests/sample/sensors"))
    >>> solid = solid_of(measured, kept="config/meshes/foam_block.vtu")
    >>> coarse = {"poisson_ratios": (0.0, 0.49), "step_m": 0.004, "edge_m": 0.01, "growth": 2.0}
    >>> table = indentation_table(measured, solid, IndentationTable(**coarse))
    >>> rig, probe = measured.sensor, measured.capture.probe
    >>> noise = Noise.expected(rig, probe, distance_m=0.8)
    >>> planned = Planned(table, measured.template, measured.support, rig, probe, noise, 3e4)
    >>> few = Protocol(0.006, 30.0, table.radius_m, table.point_m + [0, -0.5, 0.5], captures=1)
    >>> many = replace(few, captures=9)
    >>> widths = planned.forecast(few).half_width, planned.forecast(many).half_width
    >>> widths[0]["poisson_ratio"] > widths[1]["poisson_ratio"]
    True
    """

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Poisson's ratios that table and options allow."""
        low, high = self.options.poisson_ratio_bounds
        ratios = self.table.poisson_ratios
        return max(low, float(ratios[0])), min(high, greatest_ratio(ratios))

    def forecast(self, protocol: Protocol) -> Forecast:
        """What captures by a protocol are expected to determine.

        A `ValueError` as of `captures`, and if the guess of nu is not within `bounds`.
        """
        low, high = self.bounds
        if not low <= self.poisson_ratio <= high:
            found = f"{self.poisson_ratio:g}"
            raise ValueError(f"poisson_ratio: expected {low:g} to {high:g}, found {found}")
        count = protocol.captures
        drawn, scales = self._usual(replace(protocol, captures=1))
        vector = np.r_[self._guess.vector[: -unknown.OWN], np.zeros(unknown.OWN * count)]
        best = Solution((drawn,) * count, self.options, vector, (scales,) * count)
        quantities = quantities_of(best, radius_m=protocol.radius_m)
        stated = ProbeUncertainty.of(self.probe)
        budget = budget_of(best, quantities, stated, radius_m=protocol.radius_m)
        with_nu = quantities.slopes @ best.covariance @ quantities.slopes[POISSON]
        return Forecast.of(protocol, budget, with_nu, self.poisson_ratio, self.bounds)

    def _usual(self, protocol: Protocol) -> tuple[DirectIndentation, Scales]:
        """A capture with deviations as captures usually show them."""
        if (key := repr(protocol)) not in self._drawn:
            pattern_m = DEPTH_PATTERN * self.options.depth_pattern_std_m
            options = self.options.model_copy(update={"depth_pattern_std_m": pattern_m})
            found, scales, guess = [], [], self._guess
            for one in self.captures(protocol, range(DRAWS)):
                one = with_depth_errors(one, guess, options, likeliest=False)
                found.append(with_pattern(one, guess, options))
                scales.append(scales_of(found[-1], linearised(found[-1], guess)))
            mean = np.mean([(one.motion, one.sharing) for one in scales], axis=0)
            self._drawn[key] = found[0], Scales(*map(float, mean))
        return self._drawn[key]

    @cached_property
    def _drawn(self) -> dict[str, tuple[DirectIndentation, Scales]]:
        """What was drawn, by protocol."""
        return {}

    def varied(self, protocol: Protocol) -> Iterator[tuple[str, Forecast]]:
        """Forecasts of a protocol and of others that differ in one thing, with what that is.

        Others that cannot be are left out, as of a ball that hides the surface.
        """
        yield "as planned", self.forecast(protocol)
        for text, changes in self._changes(protocol):
            try:
                yield text, self.forecast(replace(protocol, **changes))
            except ValueError:
                continue

    def _changes(self, protocol: Protocol) -> Iterator[tuple[str, dict]]:
        for part in (0.5, 0.75, 1.0):
            depth_m = part * float(self.table.depth_m[-1])
            yield f"{depth_m * MILLIMETRES:.1f} mm deep", {"depth_m": depth_m}
        count = protocol.captures
        for captures in sorted({1, 2 * count, 4 * count} - {count}):
            yield f"{captures} capture{'s' * (captures > 1)}", {"captures": captures}
        for rate_hz in (protocol.frame_rate_hz / 2, protocol.frame_rate_hz * 2):
            yield f"{rate_hz:g} frames/s", {"frame_rate_hz": rate_hz}
        for size in (1 / LARGER, LARGER):
            radius_m, depth_m = size * protocol.radius_m, min(size, 1.0) * protocol.depth_m
            text = f"a ball of {radius_m * MILLIMETRES:.1f} mm radius"
            yield text, {"radius_m": radius_m, "depth_m": depth_m}

    def best_camera(self, protocol: Protocol, distance_m: float) -> Protocol:
        """The same with the camera where nu is determined best: at one of four sides.

        A `ValueError` if the surface about the contact is seen from none of them.
        """
        axes, found = axes_across(self.table.direction), []
        for aside in (*axes, *-axes):
            away = np.cos(ELEVATION) * aside - np.sin(ELEVATION) * self.table.direction
            one = replace(protocol, camera_m=self.table.point_m + distance_m * away)
            if self.support.heights_m(one.camera_m[None])[0] <= 0:
                continue
            try:
                found.append((self.forecast(one).half_width[NU], len(found), one))
            except ValueError as error:
                fault = error
        if not found:
            raise fault
        return min(found)[-1]


def as_recorded(
    table: IndentationModel,
    template: Template,
    support: Support,
    sensor: Mapping,
    probe: Mapping,
    *,
    path: pd.DataFrame,
    motion: SurfaceMotion,
    alignment: Alignment,
    found: Mapping,
    guess: tuple[float, float] | None = None,
    options: Fit | None = None,
    observation: Observation | None = None,
) -> tuple[Planned, Protocol]:
    """Plan of captures that are there, of a run's files.

    ``path`` (path.csv), ``motion`` and ``alignment`` are of the first of the captures that
    ``found``, a direct.json, is of; ``guess`` is E [Pa] and nu, else those found.
    """
    pose, forces_n = alignment.camera_from_object, columns_of(path, FORCE)
    force_n = forces_n @ pose[:3, :3] @ table.direction
    rest = force_n[: max(int(np.argmax(force_n > AT_REST * force_n.max())), FEWEST_AT_REST)]
    stds = np.nanmedian(path[ALONG_STD]), rest.std(), np.nanmedian(motion.std_m)
    E, nu = guess or (found[name]["value"] for name in ("youngs_modulus_pa", "poisson_ratio"))
    rig = sensor, probe, Noise(*map(float, stds))
    seen = {"options": options or Fit(), "observation": observation or Observation()}
    planned = Planned(table, template, support, *rig, E, nu, **seen)
    deepest = float(np.median([one["largest_depth_m"] for one in found["residuals"]]))
    rate_hz = 1 / float(np.median(np.diff(path.loc[path["frame"].notna(), "time_s"])))
    camera_m = to_object(pose, np.zeros((1, 3)))[0]
    size = min(deepest, float(table.depth_m[-1])), rate_hz, table.radius_m
    return planned, Protocol(*size, camera_m, captures=len(found["captures"]))


def narrowed(planned: Planned, protocol: Protocol, found: Mapping) -> list[dict[str, str]]:
    """What would narrow the intervals that were found: a row for each change.

    Widths of the direct.json ``found``, times what a forecast makes of the change: moduli in per
    cent. A `ValueError` as of `Planned.forecast`.
    """
    now = planned.forecast(protocol).half_width
    more = replace(protocol, captures=protocol.captures + MORE)
    ball = replace(protocol, radius_m=LARGER * protocol.radius_m)
    deep = replace(protocol, depth_m=float(planned.table.depth_m[-1]))
    of_ball = f"a ball of {MILLIMETRES * ball.radius_m:.1f} mm radius"
    changes = {"as recorded": protocol, f"{MORE} more captures": more, of_ball: ball}
    if deep.depth_m > DEEPER * protocol.depth_m:
        changes[f"indented {MILLIMETRES * deep.depth_m:.1f} mm deep"] = deep
    rows = []
    for text, one in changes.items():
        row, forecast = {"change": text}, planned.forecast(one).half_width
        for name, label in modulus.LABELS.items():
            width = (found[name]["high"] - found[name]["low"]) / 2 * forecast[name] / now[name]
            relative = f"{PERCENT * width / found[name]['value']:.0f} %"
            row[label] = f"±{width:.2f}" if found[name]["unit"] == "1" else f"±{relative}"
        rows.append(row)
    return rows
