"""The study's tracker: the template deformed to every frame by E_track (Eq. 4.23-4.25)."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.surface.template import Template

from thesis.tracker.data_points import Data, DataPoints, Frame
from thesis.tracker.energy import Smoothness
from thesis.tracker.hierarchy import Level, hierarchy
from thesis.tracker.options import Registration

# Section 4.3.1: the optimisation stops when the energy changes by less, relative to itself.
RELATIVE_CHANGE = 1e-4


class Tracker:
    """The study's tracker for one aligned template.

    Parameters
    ----------
    template : Template
    rest_m : (n, 3) array
        Its vertices in the camera frame [m].
    options : Registration
    """

    def __init__(self, template: Template, rest_m: NDArray, options: Registration) -> None:
        self.options = options
        placed = Template(rest_m, template.faces)
        self.levels = hierarchy(placed, coarsest_vertices=options.coarsest_vertices)
        self.smoothness = [Smoothness(lv.template, reach=options.s_sm) for lv in self.levels]
        self.numbers = _numbers(self.levels)

    def track(self, start_m: NDArray, frame: Frame) -> tuple[NDArray, "Fit"]:
        """Minimise E_track for one frame, from the coarsest mesh to the finest.

        Parameters
        ----------
        start_m : (n, 3) array
            Translations of the vertices in the frame before; zero for the first [m].
        frame : Frame
        """
        data = DataPoints(frame, self.options)
        shift, fit = start_m[self.numbers[0]], None
        for number in range(len(self.levels)):
            shift, fit = self._minimise(shift, number, data)
            if number + 1 < len(self.levels):
                shift = self._refined(shift, number)
        return shift, fit

    def deform(self, shift_m: NDArray, target_m: NDArray, chosen: NDArray) -> NDArray:
        """Minimise E_def (Eq. 4.28) over the translations of some vertices.

        Parameters
        ----------
        shift_m : (n, 3) array
            Translations [m].
        target_m : (n, 3) array
            TP(p_i) [m].
        chosen : (n,) bool array
            Vertices whose translations change.
        """
        options, smoothness = self.options, self.smoothness[-1]
        goal = (target_m - self.levels[-1].template.vertices_m)[chosen]
        return smoothness.draw(shift_m, goal, chosen, options.w_data, options.w_sm_stop)

    def _minimise(self, shift_m: NDArray, number: int, data: DataPoints) -> tuple[NDArray, "Fit"]:
        options, template = self.options, self.levels[number].template
        smoothness, w_sm, before = self.smoothness[number], self.options.w_sm, np.inf
        while w_sm >= options.w_sm_stop:
            for _ in range(options.rounds):
                found, captured = data.nearest(template, shift_m, self.numbers[number])
                shift_m, energy = smoothness.descend(shift_m, found, w_sm)
            if np.isfinite(before) and before - energy < RELATIVE_CHANGE * before:
                break
            before, w_sm = energy, w_sm / 2
        return shift_m, Fit(found, captured)

    def _refined(self, coarse_m: NDArray, number: int) -> NDArray:
        """Translations of the next mesh: taken over, and the smoothest for its own vertices."""
        kept, finer = self.levels[number].kept, self.levels[number + 1].template
        shift = np.zeros_like(finer.vertices_m)
        known = np.isin(np.arange(len(shift)), kept)
        shift[kept] = coarse_m
        return self.smoothness[number + 1].fill(shift, known)


@dataclass(frozen=True)
class Fit:
    """How a frame's data held the template in the end.

    Attributes
    ----------
    data : Data
        Last nearest data points and weights.
    captured : (n,) bool array
        Vertices whose nearest data point was captured, not added.
    """

    data: Data
    captured: NDArray

    @property
    def held(self) -> NDArray:
        """Vertices whose position rests on data points, added ones too, shape (n,)."""
        return self.data.weights > 0

    @property
    def observed(self) -> NDArray:
        """Vertices whose position rests on captured points, shape (n,)."""
        return self.held & self.captured

    def residual_m(self, displacement_m: NDArray) -> float:
        """Root mean square distance of observed vertices to their data [m]."""
        return float(np.sqrt(np.mean(self.data.gaps(displacement_m)[self.observed] ** 2)))


def track_frames(
    template: Template,
    rest_m: NDArray,
    frames: Iterable[Frame],
    options: Registration,
    *,
    complete: Callable[[NDArray, NDArray, NDArray], NDArray] | None = None,
) -> tuple[NDArray, NDArray, NDArray]:
    """Deform the aligned template to each frame, starting from the frame before.

    Parameters
    ----------
    template : Template
    rest_m : (n, 3) array
        Its vertices in the camera frame [m].
    frames : iterable of Frame
    options : Registration
    complete : callable, optional
        Takes the vertices (n, 3) [m] of the frame before and of this one, and which of these rest
        on data (n,), and gives places TP (n, 3) [m] for the others (Section 4.3.2); called once
        for each frame in turn.

    Returns
    -------
    vertices_m : (f, n, 3) array
    observed : (f, n) bool array
    residual_m : (f,) array

    Raises
    ------
    ValueError
        If a frame has no captured points near the template.
    """
    tracker = Tracker(template, rest_m, options)
    shift, results = np.zeros_like(rest_m), []
    for number, frame in enumerate(frames):
        before = rest_m + shift
        shift, fit = tracker.track(shift, frame)
        if not fit.observed.any():
            raise ValueError(
                f"frame {number}: expected captured points near the template, found none"
            )
        if complete is not None:
            places = complete(before, rest_m + shift, fit.held)
            shift = tracker.deform(shift, places, ~fit.held)
        results.append((rest_m + shift, fit.observed, fit.residual_m(shift)))
    return tuple(np.array(values) for values in zip(*results, strict=True))


def _numbers(levels: Sequence[Level]) -> list[NDArray]:
    """Numbers of each level's vertices in the finest mesh."""
    numbers = [levels[-1].kept]
    for level in reversed(levels[:-1]):
        numbers.insert(0, numbers[0][level.kept])
    return numbers
