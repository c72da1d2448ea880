"""Captures that were not recorded: by a table, a guess of the moduli, and the noise of a rig."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.config.sensor import said_of_base
from palpate.estimate.direct import indentation as unknown
from palpate.estimate.direct.contact import FORCE_DEVIATIONS, Contact
from palpate.estimate.direct.indentation import (
    DirectIndentation,
    Parameters,
    SupportAxes,
    residuals,
)
from palpate.estimate.direct.motion import tip_clearance
from palpate.estimate.direct.options import (
    BASE_SOURCE,
    TIP_PART,
    TIP_SOURCE,
    Fit,
    Observation,
    ProbeUncertainty,
)
from palpate.estimate.direct.problem import compared_m
from palpate.estimate.direct.samples import ProbeInView, RestSurface, Samples, samples_of
from palpate.estimate.direct.table import SampleTable, axes_across, force_table, sample_table
from palpate.estimate.hertz.indentation import force_onset
from palpate.noise import Noise, by_target
from palpate.open3d_core import o3d, scene_of
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.support import Support
from palpate.surface.sharp_edges import sharp_edge_distance
from palpate.surface.template import Template
from palpate.units import MILLIMETRES
from palpate.vision.clock import stated_clock_std_s
from palpate.vision.probe import marker_from_tip

# Of a recording: at rest, towards the object, into it, held [s]; and where the tip waits [m].
LASTS_S, AWAY_M = (1.0, 0.6, 1.8, 0.9), 0.015
# As captures of the default objects show them: over such a length displacements err together [m],
# and by this part of themselves.
ALIKE_M, PATTERN = 0.008, 0.02
# A sample is in view from so far above the surface [m].
CLEAR_M = 1e-4
POINTS_PER_SAMPLE = 40


@dataclass(frozen=True)
class Protocol:
    """How an object is to be indented.

    Attributes
    ----------
    depth_m : float
        Maximum depth [m].
    frame_rate_hz : float
    radius_m : float
        Of the sphere [m].
    camera_m : (3,) array
        Where the camera stands, object frame [m].
    captures : int
        At the point of the table, or at others like it.
    """

    depth_m: float
    frame_rate_hz: float
    radius_m: float
    camera_m: NDArray
    captures: int = 3


@dataclass(frozen=True)
class PlannedCaptures:
    """An object, a rig and a guess of the moduli, of which captures are made up.

    Attributes
    ----------
    table : IndentationModel
        Of the point that is to be indented.
    template : Template
    support : Support
    sensor, probe : mapping
        The sensor's and the probe's file.
    noise : Noise
    youngs_modulus_pa, poisson_ratio : float
        Guesses.
    options : Fit, optional
    observation : Observation, optional
    """

    table: IndentationModel
    template: Template
    support: Support
    sensor: Mapping
    probe: Mapping
    noise: Noise
    youngs_modulus_pa: float
    poisson_ratio: float = 0.3
    options: Fit = field(default_factory=Fit)
    observation: Observation = field(default_factory=Observation)

    @cached_property
    def _samples(self) -> tuple[Samples, SampleTable, NDArray]:
        """Of the surface about the contact, their table, and how far they are from sharp edges."""
        contact, options = self.table.point_m, self.observation
        mesh = trimesh.Trimesh(self.template.vertices_m, self.template.faces, process=False)
        count = int(POINTS_PER_SAMPLE * mesh.area / options.spacing_m**2)
        places, faces = trimesh.sample.sample_surface(mesh, count, seed=0)
        near = np.linalg.norm(places - contact, axis=1) < options.reach_m
        normals = mesh.face_normals[faces[near]]
        closest = RestSurface(self.template).at_rest(places[near], normals, options)
        found = samples_of([closest], contact, spacing_m=options.spacing_m)
        edges_m = sharp_edge_distance(self.template.vertices_m, self.template.faces, found.cell_m)
        return found, sample_table(self.table, found.cell_m, found.normal), edges_m

    @property
    def samples(self) -> Samples:
        """Of the surface about the contact, whether a camera sees them or not."""
        return self._samples[0]

    @property
    def _guess(self) -> Parameters:
        """Of a capture that neither relaxes nor errs."""
        times_s = np.array(self.options.relaxation_times_s, dtype=float)
        vector = np.zeros(unknown.SHARED + len(times_s) + unknown.OWN)
        vector[[unknown.LOG_E, unknown.NU]] = np.log(self.youngs_modulus_pa), self.poisson_ratio
        return Parameters(vector, times_s)

    def captures(self, protocol: Protocol, seeds: Iterable[int]) -> Iterator[DirectIndentation]:
        """Captures by a protocol with the rig's noise, one drawn with each seed.

        A `ValueError` if it goes deeper than the table, the force stays within its noise, too few
        frames are in contact, or no sample of the surface is in view.
        """
        exact, rest = self.exact(protocol, *self._record(protocol))
        motion = np.zeros(exact.moved_m.shape)
        motion[exact.seen] = -residuals(exact, self._guess).motion * exact.moved_std_m[exact.seen]
        for seed in seeds:
            yield self.noisy(exact, motion, rest, np.random.default_rng(seed))

    def noisy(
        self,
        exact: DirectIndentation,
        motion_m: NDArray,
        rest: int,
        rng: np.random.Generator,
        *,
        tip: float = 1.0,
        surface: float = 1.0,
    ) -> DirectIndentation:
        """A capture with noise of its depths, and of displacements (k, c) [m] that are added.

        ``rest`` frames are at rest; ``tip`` and ``surface`` are the noise over that stated.
        """
        std_m, cell_m = exact.moved_std_m, exact.cell_m
        apart = np.linalg.norm(cell_m[:, None] - cell_m, axis=2)
        root = np.linalg.cholesky(np.exp(-((apart / ALIKE_M) ** 2)) + 1e-6 * np.eye(len(apart)))
        # Noise of displacements, with errors that samples share; and of depths.
        noise, (at_rest, pattern, *_) = rng.normal(size=(2, *motion_m.shape)) @ root.T
        errors = surface * std_m * (noise + at_rest / np.sqrt(rest)) + PATTERN * motion_m * pattern
        return replace(
            exact,
            moved_m=exact.moved_m + motion_m + errors,
            moved_std_m=exact.noise_std_m,
            depth_m=exact.depth_m + tip * exact.tip_std_m * rng.normal(size=len(exact.depth_m)),
        )

    def _record(self, protocol: Protocol) -> tuple[NDArray, NDArray, NDArray]:
        """Times [s], depths [m] and forces along the indentation [N] by the guess, (f,) each."""
        table = force_table(self.table)
        table = _of_size(table, protocol.radius_m / self.table.radius_m)
        lasts = np.cumsum([0.0, *LASTS_S])
        time_s = np.arange(0, lasts[-1], 1 / protocol.frame_rate_hz)
        depth_m = np.interp(time_s, lasts, [-AWAY_M, -AWAY_M, 0.0, *[protocol.depth_m] * 2])
        unit = table.force(np.maximum(depth_m, 0), self._guess.poisson_ratio, 0.0)
        return time_s, depth_m, self._guess.youngs_modulus_pa * unit

    def exact(
        self, protocol: Protocol, time_s: NDArray, depth_m: NDArray, force_n: NDArray
    ) -> tuple[DirectIndentation, int]:
        """A capture without noise, its displacements 0, and how many frames it has at rest.

        Of times [s], depths [m] and forces along the indentation [N], (f,) each; errors are those
        of `captures`.
        """
        samples, table, edges_m = self._samples
        table = _of_size(table, protocol.radius_m / self.table.radius_m)
        if protocol.depth_m > table.depth_m[-1] * (1 + 1e-9):
            deepest, found = (MILLIMETRES * one for one in (table.depth_m[-1], protocol.depth_m))
            expected = f"up to the table's {deepest:.1f} mm"
            raise ValueError(f"depth: expected {expected}, found {found:g} mm")
        options, direction = self.options, self.table.direction
        least_n = FORCE_DEVIATIONS * self.noise.force_n
        least_n = max(least_n, options.least_force_share * force_n.max())
        onset = force_onset(force_n, onset_force_n=least_n)
        contact = Contact(depth_m, force_n, least_n, onset)
        frames = contact.loaded_frames(tip_std_m=self.noise.tip_m)
        if len(frames) < (fewest := 2 + len(options.relaxation_times_s)):
            expected = f"{fewest} frames in contact or more"
            raise ValueError(f"frame_rate_hz: expected {expected}, found {len(frames)}")
        tips_m = self.table.point_m + (depth_m - protocol.radius_m)[:, None] * direction
        middle, tips_m = tips_m[frames].mean(axis=0), tips_m[frames]
        of_protocol = protocol.radius_m, protocol.depth_m
        limits_m = compared_m(self.table, self.support, options, *of_protocol)
        near = self._near(samples, middle, limits_m) & (edges_m > options.crease_m)
        if not near.any():
            low, high = (f"{MILLIMETRES * one:.0f}" for one in limits_m)
            expected = f"some from {low} to {high} mm from the contact, off base and edges"
            raise ValueError(f"samples: expected {expected}, found none")
        chosen = near & self._in_view(samples, protocol.camera_m)
        samples, names = samples.at(chosen), ("motion_m", "motion_change_m", "motion_by_place")
        table = replace(table, **{name: getattr(table, name)[..., chosen] for name in names})
        hidden, rest = self._hidden(samples, tips_m, protocol), int((depth_m <= depth_m[0]).sum())
        if hidden.all():
            raise ValueError("samples: expected some that the camera sees, found all hidden")
        std_m = np.where(hidden, np.nan, self.noise.surface_m)
        clock_std_s = said_of_base(self.sensor, "clock_offset_std_s")
        given = {"support": self.support, "contact_m": middle, "direction": direction}
        exact = DirectIndentation(
            time_s=time_s,
            force_n=contact.force_n,
            tip_depth_m=depth_m,
            frames=frames,
            frames_beyond=0,
            oblique_rad=0.0,
            depth_m=depth_m[frames],
            tip_std_m=self.noise.tip_m,
            depth_root_m=self.noise.tip_m * np.eye(len(frames)),
            offset_std_m=float(np.hypot(self.noise.tip_m, options.offset_std_m)),
            clock_expected_s=0.0,
            clock_std_s=stated_clock_std_s(self.sensor),
            force_std_n=self.noise.force_n,
            place_expected_m=np.zeros(unknown.PLACES),
            place_std_m=np.sqrt(1 - TIP_PART) * options.place_std_m,
            contact_m=middle,
            cell_m=samples.cell_m,
            moved_m=0 * std_m,
            noise_std_m=std_m * np.sqrt(1 + 1 / rest),
            moved_std_m=std_m,
            cluster=np.zeros(len(samples.cell_m), dtype=int),
            support_axes=SupportAxes.of(samples.cell_m, samples.normal, **given, options=options),
            table=table,
            camera_clock_std_s=clock_std_s if self._base else 0.0,
            shared_roots_m=self._roots_m(protocol.camera_m),
        )
        return exact, rest

    @property
    def _base(self) -> Mapping | None:
        """Of a sensor's file, where poses come from elsewhere than its pictures."""
        return None if by_target(self.sensor, self.probe) else self.sensor.get("base")

    def _roots_m(self, camera_m: NDArray) -> dict[str, NDArray]:
        """Errors of the tip that captures share, along the indentation and across, (3, e) [m]."""
        known = ProbeUncertainty.of(self.probe, self._base)
        # The tip's frame has the indentation last.
        turn = marker_from_tip(self.probe)[:3, [2, 0, 1]].T
        roots = {TIP_SOURCE: turn @ known.tip_root_m(self.options.place_std_m)}
        if known.base is not None:
            ahead = self.table.point_m - camera_m
            axes = axes_across(ahead / np.linalg.norm(ahead))
            along = np.stack([self.table.direction, *axes_across(self.table.direction)])
            turn = along @ np.stack([*axes, ahead / np.linalg.norm(ahead)]).T
            place_m = np.array([0.0, 0.0, np.linalg.norm(ahead)])
            roots[BASE_SOURCE] = turn @ known.base_root_m(place_m)
        return roots

    def _near(self, samples: Samples, middle_m: NDArray, limits_m: tuple[float, float]) -> NDArray:
        """Samples neither under the sphere nor too far off nor on the base, (c,) bool."""
        away, direction = samples.cell_m - middle_m, self.table.direction
        beside = np.linalg.norm(away - (away @ direction)[:, None] * direction, axis=1)
        near = (beside > limits_m[0]) & (np.linalg.norm(away, axis=1) < limits_m[1])
        return near & ~self.support.holds(samples.cell_m)

    def _hidden(self, samples: Samples, tips_m: NDArray, protocol: Protocol) -> NDArray:
        """What the probe hides, (frames, samples) bool."""
        camera_m, options = protocol.camera_m, self.observation
        away_m = float(np.linalg.norm(camera_m - self.table.point_m))
        clear_m = tip_clearance(self.sensor, away_m, options, radius_m=protocol.radius_m)
        axes = np.broadcast_to(self.table.direction, tips_m.shape)
        probe = ProbeInView(camera_m[None], tips_m, axes)
        return probe.hides(samples.cell_m, options.changed(clear_m=clear_m))

    def _in_view(self, samples: Samples, camera_m: NDArray) -> NDArray:
        """Which samples the camera sees past other parts of the object, (c,) bool."""
        contact, sight = self.table.point_m, camera_m - samples.cell_m
        start = samples.cell_m - contact + CLEAR_M * samples.normal
        scene = scene_of(self.template.vertices_m - contact, self.template.faces)
        rays = o3d.core.Tensor(np.hstack([start, sight]).astype(np.float32))
        clear = ~scene.test_occlusions(rays, nthreads=1).numpy()
        least = np.cos(np.deg2rad(self.observation.largest_view_deg))
        along = (sight * samples.normal).sum(axis=1)
        return clear & (along > least * np.linalg.norm(sight, axis=1))


def _of_size(table: SampleTable, size: float) -> SampleTable:
    """Table of a sphere so many times as large, as on a half-space; far off by the force alone."""
    return replace(
        table,
        depth_m=size * table.depth_m,
        force_per_modulus_m2=size**2 * table.force_per_modulus_m2,
        motion_m=size**2 * table.motion_m,
        motion_change_m=size**2 * table.motion_change_m,
        motion_by_place=size**2 * table.motion_by_place,
    )
