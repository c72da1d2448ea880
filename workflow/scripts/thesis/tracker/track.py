"""The study's tracker: the template deformed to every frame by E_track (Eq. 4.23-4.25)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.surface.template import Template, vertex_normals

from thesis.tracker.data_points import DataPoints, Frame
from thesis.tracker.energy import Data, descend
from thesis.tracker.hierarchy import Level, hierarchy
from thesis.tracker.options import Registration
from thesis.tracker.smoothness import Smoothness, Transforms

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
        reach = {"reach": options.s_sm, "measure": options.neighbourhood}
        self.smoothness = [Smoothness(level.template, **reach) for level in self.levels]
        self.numbers = _numbers(self.levels)
        self.still = [self._still(level.template) for level in self.levels]

    def track(self, start: Transforms, frame: Frame) -> tuple[Transforms, "Fit"]:
        """Minimise E_track for one frame, from the coarsest mesh to the finest.

        Parameters
        ----------
        start : Transforms
            Of the frame before; identity for the first.
        frame : Frame
        """
        data = DataPoints(frame, self.options)
        transforms, fit = start.of(self.numbers[0]), None
        for number, level in enumerate(self.levels):
            transforms, fit = self._minimise(transforms, number, data)
            if number + 1 < len(self.levels):
                transforms = self._refined(transforms, level, number + 1)
        return transforms, fit

    def deform(self, transforms: Transforms, target_m: NDArray, chosen: NDArray) -> Transforms:
        """Minimise E_def (Eq. 4.28) over the transforms of some vertices.

        Parameters
        ----------
        transforms : Transforms
        target_m : (n, 3) array
            TP(p_i) [m].
        chosen : (n,) bool array
            Vertices whose transforms change.
        """
        options, smoothness = self.options, self.smoothness[-1]
        goal = (target_m - self.levels[-1].template.vertices_m)[chosen]
        return smoothness.draw(transforms, goal, chosen, options.w_data, options.w_sm_stop)

    def _minimise(
        self, transforms: Transforms, number: int, data: "DataPoints"
    ) -> tuple[Transforms, "Fit"]:
        options, template = self.options, self.levels[number].template
        smoothness, w_sm, before = self.smoothness[number], self.options.w_sm, np.inf
        while w_sm >= options.w_sm_stop:
            for _ in range(options.rounds):
                found, captured = data.nearest(
                    template, transforms.displacement_m, self.numbers[number]
                )
                transforms, energy = descend(
                    transforms, found, smoothness, w_sm, rotations=options.rotations
                )
            if np.isfinite(before) and before - energy < RELATIVE_CHANGE * before:
                break
            before, w_sm = energy, w_sm / 2
        return transforms, Fit(found, captured)

    def _refined(self, coarse: Transforms, level: Level, finer: int) -> Transforms:
        """Parameters of the next mesh: taken over, and the smoothest ones for its own vertices."""
        fine = self.still[finer]
        known = np.zeros(len(fine.angle), dtype=bool)
        known[level.kept] = True
        values = {name: getattr(fine, name).copy() for name in vars(fine)}
        for name, array in values.items():
            array[level.kept] = getattr(coarse, name)
        return self.smoothness[finer].fill(Transforms(**values), known)

    @staticmethod
    def _still(template: Template) -> Transforms:
        """Identity, with axes along the normals."""
        normals = vertex_normals(template.vertices_m, template.faces)
        return Transforms(np.zeros_like(normals), normals, np.zeros(len(normals)))


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
    frames: Sequence[Frame],
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
    frames : sequence of Frame
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
    transforms, results = tracker.still[-1], []
    for number, frame in enumerate(frames):
        before = rest_m + transforms.displacement_m
        transforms, fit = tracker.track(transforms, frame)
        if not fit.observed.any():
            raise ValueError(
                f"frame {number}: expected captured points near the template, found none"
            )
        if complete is not None:
            places = complete(before, rest_m + transforms.displacement_m, fit.held)
            transforms = tracker.deform(transforms, places, ~fit.held)
        moved = transforms.displacement_m
        results.append((rest_m + moved, fit.observed, fit.residual_m(moved)))
    return tuple(np.array(values) for values in zip(*results, strict=True))


def _numbers(levels: Sequence[Level]) -> list[NDArray]:
    """Numbers of each level's vertices in the finest mesh."""
    numbers = [levels[-1].kept]
    for level in reversed(levels[:-1]):
        numbers.insert(0, numbers[0][level.kept])
    return numbers
