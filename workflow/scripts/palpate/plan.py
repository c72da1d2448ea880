"""What captures are going to determine: the estimate's own uncertainty budget, before them.

Captures are made up from an indentation table, a guess of E and the rig's noise, and the budget is
drawn up for them as for captures that were recorded.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import stdtrit

from palpate import modulus
from palpate.estimate.direct import indentation as unknown
from palpate.estimate.direct.budget import Budget, budget_of
from palpate.estimate.direct.contact import Contact
from palpate.estimate.direct.deviations import (
    Scales,
    scales_of,
    with_depth_errors,
    with_pattern,
)
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import (
    DirectIndentation,
    Parameters,
    SupportAxes,
    linearised,
    residuals,
)
from palpate.estimate.direct.motion import tip_clearance
from palpate.estimate.direct.options import (
    TIP_PART,
    TIP_SOURCE,
    Fit,
    Observation,
    ProbeUncertainty,
)
from palpate.estimate.direct.quantities import POISSON, quantities_of
from palpate.estimate.direct.samples import (
    ProbeInView,
    RestSurface,
    Samples,
    samples_of,
)
from palpate.estimate.direct.table import SampleTable, axes_across, sample_table
from palpate.open3d_core import o3d, scene_of
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.load import hertz_contact_radius
from palpate.solid.support import Support
from palpate.surface.sharp_edges import sharp_edge_distance
from palpate.surface.template import Template
from palpate.units import MILLIMETRES
from palpate.vision.camera import PinholeCamera
from palpate.vision.clock import stated_clock_std_s
from palpate.vision.marker import board_of
from palpate.vision.pose import corner_cofactor, point_covariance
from palpate.vision.probe import marker_from_tip

# Of a recording: at rest, towards the object, into it, held [s]; and where the tip waits [m].
LASTS_S, AWAY_M = (1.0, 0.6, 1.8, 0.9), 0.015
# Of a camera that looks at the contact from the side.
ELEVATION = np.deg2rad(45.0)
# Where nothing is stated: noise of disparities averaged over a sample, and of corners [px], of
# forces at frames [N], and a baseline [m].
DISPARITY_PX, CORNER_PX, FORCE_N, BASELINE_M = 0.02, 0.02, 0.01, 0.055
# Of the target about the probe, until it faces the camera.
TURNS = 36
# As captures of the default objects show them: over such a way displacements err together [m], by
# this part of themselves; and depths by this multiple of what is held likely.
ALIKE_M, PATTERN, DEPTH_PATTERN = 0.008, 0.02, 2.0
# Noises whose scatter is averaged.
DRAWS = 4
# A sample is in view from so far above the surface [m].
CLEAR_M = 1e-4
POINTS_PER_SAMPLE = 40


@dataclass(frozen=True)
class Noise:
    """Standard deviations from frame to frame.

    Attributes
    ----------
    tip_m : float
        Of the tip along the indentation [m].
    force_n : float
        Of the force at a frame [N].
    surface_m : float
        Of the displacement of a sample of the surface [m].
    """

    tip_m: float
    force_n: float
    surface_m: float

    @staticmethod
    def expected(sensor: Mapping, probe: Mapping, distance_m: float) -> "Noise":
        """Of a rig that nobody has measured yet, by optics, target and distance [m].

        Stereo heads and structured light know depths to a part of a pixel of disparity: z^2/(f b).
        """
        if "cloud" in sensor or "marker" not in probe:
            base = (sensor.get("base") or {}).get("pose_std_m", 1e-4)
            return Noise(base, FORCE_N, DISPARITY_PX * distance_m**2 / (600 * BASELINE_M))
        optics = sensor["depth"] if "depth" in sensor else sensor["color"]
        baseline_m = (sensor.get("stereo") or optics).get("baseline_m", BASELINE_M)
        surface_m = DISPARITY_PX * distance_m**2 / (optics["fx_px"] * baseline_m)
        return Noise(_tip_std(sensor["color"], probe, distance_m), FORCE_N, surface_m)


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
    captures, points : int
        Captures of each point, and points like the one that the table is of.
    """

    depth_m: float
    frame_rate_hz: float
    radius_m: float
    camera_m: NDArray
    captures: int = 3
    points: int = 1


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
        widths = {f"{name}_half_width": width for name, width in self.half_width.items()}
        return {"settings": protocol, **widths, "verdict": self.verdict, "limit": self.limit}

    @staticmethod
    def of(
        protocol: Protocol, budget: Budget, with_nu: NDArray, nu: float, options: Fit
    ) -> "Forecast":
        """Intervals by a budget and covariances with nu (7,), about a guess of nu."""
        quantile = stdtrit(budget.freedom, (1 + modulus.CONFIDENCE) / 2)
        half = quantile[POISSON] * budget.std[POISSON]
        low, high = np.clip([nu - half, nu + half], *options.poisson_ratio_bounds)
        # Where its range ends the interval of nu, moduli follow no farther.
        left = 1 - ((high - low) / (2 * half)) ** 2
        variance = budget.std**2 - left * with_nu**2 / with_nu[POISSON]
        half = quantile * np.sqrt(np.maximum(variance, 0.0))
        widths, verdicts, limits = {}, {}, {}
        for k, name in enumerate(modulus.LABELS):
            widths[name] = float((high - low) / 2 if k == POISSON else np.sinh(half[k]))
            ends = np.exp([-half[k], half[k]])
            verdicts[name] = modulus.Modulus.of_pascals(1.0, *ends).verdict
            limits[name] = max((one.contributions[k], one.name) for one in budget.sources)[1]
        name = list(modulus.LABELS)[POISSON]
        verdicts[name] = modulus.verdict_of_nu(low, high, options.poisson_ratio_bounds)
        return Forecast(protocol, widths, verdicts, limits)


@dataclass(frozen=True)
class Planned:
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
    >>> widths = [planned.forecast(one).half_width["poisson_ratio"] for one in
    ...           (few, replace(few, captures=9))]
    >>> widths[0] > widths[1]
    True
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

    def forecast(self, protocol: Protocol) -> Forecast:
        """What captures by a protocol are expected to determine.

        Raises
        ------
        ValueError
            If it goes deeper than the table, or no sample of the surface is in view.
        """
        count = protocol.captures * protocol.points
        one, scales = self._usual(replace(protocol, captures=1, points=1))
        vector = np.r_[self._guess.vector[: -unknown.OWN], np.zeros(unknown.OWN * count)]
        best = Solution((one,) * count, self.options, vector, (scales,) * count)
        quantities = quantities_of(best, radius_m=protocol.radius_m)
        stated = ProbeUncertainty.of(self.probe)
        budget = budget_of(best, quantities, stated, radius_m=protocol.radius_m)
        with_nu = quantities.slopes @ best.covariance @ quantities.slopes[POISSON]
        return Forecast.of(protocol, budget, with_nu, self.poisson_ratio, self.options)

    def _usual(self, protocol: Protocol) -> tuple[DirectIndentation, Scales]:
        """A capture with deviations as captures usually show them."""
        key = repr(protocol)
        if key not in self._drawn:
            pattern_m = DEPTH_PATTERN * self.options.depth_pattern_std_m
            options = self.options.model_copy(update={"depth_pattern_std_m": pattern_m})
            found, guess = [], self._guess
            for seed in range(DRAWS):
                one = self.capture(protocol, seed=seed)
                one = with_depth_errors(one, guess, options, likeliest=False)
                one = with_pattern(one, guess, options)
                found.append((one, scales_of(one, linearised(one, guess))))
            mean = np.mean([(scales.motion, scales.sharing) for _, scales in found], axis=0)
            self._drawn[key] = found[0][0], Scales(*map(float, mean))
        return self._drawn[key]

    @cached_property
    def _drawn(self) -> dict[str, tuple[DirectIndentation, Scales]]:
        """What was drawn, by protocol."""
        return {}

    def varied(self, protocol: Protocol) -> Iterator[tuple[str, Forecast]]:
        """Forecasts of a protocol and of others that differ in one thing, with what that is."""
        yield "as planned", self.forecast(protocol)
        for part in (0.5, 0.75, 1.0):
            depth_m = part * float(self.table.depth_m[-1])
            changed = replace(protocol, depth_m=depth_m)
            yield f"{depth_m * MILLIMETRES:.1f} mm deep", self.forecast(changed)
        for captures in (1, 6, 12):
            text = f"{captures} capture{'s' * (captures > 1)} of each point"
            yield text, self.forecast(replace(protocol, captures=captures))
        for points in (2, 4):
            yield f"{points} points", self.forecast(replace(protocol, points=points))
        for rate_hz in (protocol.frame_rate_hz / 2, protocol.frame_rate_hz * 2):
            yield f"{rate_hz:g} frames/s", self.forecast(replace(protocol, frame_rate_hz=rate_hz))
        for size in (0.7, 1.4):
            radius_m, depth_m = size * protocol.radius_m, min(size, 1.0) * protocol.depth_m
            changed = replace(protocol, radius_m=radius_m, depth_m=depth_m)
            text = f"a ball of {radius_m * MILLIMETRES:.1f} mm radius"
            yield text, self.forecast(changed)

    def best_camera(self, protocol: Protocol, distance_m: float) -> Protocol:
        """The same with the camera where nu is determined best: at one of four sides."""
        axes = axes_across(self.table.direction)
        places = []
        for aside in (*axes, *-axes):
            away = np.cos(ELEVATION) * aside - np.sin(ELEVATION) * self.table.direction
            places.append(replace(protocol, camera_m=self.table.point_m + distance_m * away))
        return min(places, key=self._width_of_nu)

    def _width_of_nu(self, protocol: Protocol) -> float:
        try:
            return self.forecast(protocol).half_width["poisson_ratio"]
        except ValueError:  # nothing is seen from there
            return np.inf

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
    def _guess(self) -> Parameters:
        """Of a capture that neither relaxes nor errs."""
        times_s = np.array(self.options.relaxation_times_s, dtype=float)
        vector = np.zeros(unknown.SHARED + len(times_s) + unknown.OWN)
        vector[[unknown.LOG_E, unknown.NU]] = np.log(self.youngs_modulus_pa), self.poisson_ratio
        return Parameters(vector, times_s)

    def capture(self, protocol: Protocol, *, seed: int = 0) -> DirectIndentation:
        """A capture by a protocol with the rig's noise, drawn with a seed.

        Raises
        ------
        ValueError
            As `forecast` does.
        """
        samples, table, edges_m = self._samples
        table = _of_size(table, protocol.radius_m / self.table.radius_m)
        if protocol.depth_m > table.depth_m[-1] * (1 + 1e-9):
            deepest, found = (MILLIMETRES * one for one in (table.depth_m[-1], protocol.depth_m))
            raise ValueError(f"depth: expected up to the table's {deepest:.1f} mm, found {found:g}")
        guess, options, direction = self._guess, self.options, self.table.direction
        lasts = np.cumsum([0.0, *LASTS_S])
        time_s = np.arange(0, lasts[-1], 1 / protocol.frame_rate_hz)
        depth_m = np.interp(time_s, lasts, [-AWAY_M, -AWAY_M, 0.0, *[protocol.depth_m] * 2])
        unit = table.force(np.maximum(depth_m, 0), guess.poisson_ratio, 0.0)
        contact = Contact.of(depth_m, guess.youngs_modulus_pa * unit, options)
        frames = contact.loaded_frames(tip_std_m=self.noise.tip_m)
        tips_m = self.table.point_m + (depth_m - protocol.radius_m)[:, None] * direction
        middle, tips_m = tips_m[frames].mean(axis=0), tips_m[frames]
        chosen = self._compared(samples, middle, protocol) & (edges_m > options.crease_m)
        samples = samples.at(chosen)
        hidden, rest = self._hidden(samples, tips_m, protocol), int((depth_m <= depth_m[0]).sum())
        if hidden.all():
            raise ValueError("samples: expected some that the camera sees, found all hidden")
        std_m = np.where(hidden, np.nan, self.noise.surface_m)
        given = {"support": self.support, "contact_m": middle, "direction": direction}
        tip_root_m = ProbeUncertainty.of(self.probe).tip_root_m(options.place_std_m)
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
            table=_at(table, chosen),
            # The tip's frame has the indentation last.
            shared_roots_m={TIP_SOURCE: marker_from_tip(self.probe)[:3, [2, 0, 1]].T @ tip_root_m},
        )
        return _with_noise(exact, guess, rest, np.random.default_rng(seed))

    def _compared(self, samples: Samples, middle_m: NDArray, protocol: Protocol) -> NDArray:
        """Samples neither under the sphere nor too far off that the camera can see, (c,) bool."""
        options, direction = self.options, self.table.direction
        size = {"indenter_radius_m": protocol.radius_m, "depth_m": protocol.depth_m}
        nearest_m = options.nearest_m + options.nearest_radii * hertz_contact_radius(**size)
        away = samples.cell_m - middle_m
        beside = np.linalg.norm(away - (away @ direction)[:, None] * direction, axis=1)
        near = np.linalg.norm(away, axis=1) < options.farthest_m
        near &= ~self.support.holds(samples.cell_m)
        return (beside > nearest_m) & near & self._in_view(samples, protocol.camera_m)

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
        contact = self.table.point_m
        sight = camera_m - samples.cell_m
        start = samples.cell_m - contact + CLEAR_M * samples.normal
        scene = scene_of(self.template.vertices_m - contact, self.template.faces)
        rays = o3d.core.Tensor(np.hstack([start, sight]).astype(np.float32))
        clear = ~scene.test_occlusions(rays, nthreads=1).numpy()
        least = np.cos(np.deg2rad(self.observation.largest_view_deg))
        along = (sight * samples.normal).sum(axis=1)
        return clear & (along > least * np.linalg.norm(sight, axis=1))


def _tip_std(camera: Mapping, probe: Mapping, distance_m: float) -> float:
    """Deviation of a tip along the indentation [m]; the target is turned to the camera."""
    corners_m, fixed = board_of(probe["marker"]).points_m, marker_from_tip(probe)
    ahead = np.array([0.0, np.cos(ELEVATION), np.sin(ELEVATION)])
    turns = [
        Rotation.from_rotvec(angle * ahead).as_matrix()
        @ np.column_stack([[1.0, 0, 0], np.cross(ahead, [1.0, 0, 0]), ahead])
        @ fixed[:3, :3].T
        for angle in np.linspace(0, 2 * np.pi, TURNS, endpoint=False)
    ]
    pose = np.eye(4)
    pose[:3, :3] = max(turns, key=lambda turn: abs(turn[2, 2]))
    pose[:3, 3] = [0, 0, distance_m] - pose[:3, :3] @ fixed[:3, 3]
    names = "width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px"
    optics = PinholeCamera(*(camera[name] for name in names))
    covariance = CORNER_PX**2 * corner_cofactor(corners_m, pose, optics)
    tip = point_covariance(pose, covariance, fixed[:3, 3])
    return float(np.sqrt(ahead @ tip @ ahead))


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


def _at(table: SampleTable, chosen: NDArray) -> SampleTable:
    """Table of some of its samples."""
    names = "motion_m", "motion_change_m", "motion_by_place"
    return replace(table, **{name: getattr(table, name)[..., chosen] for name in names})


def _with_noise(
    exact: DirectIndentation, of: Parameters, rest: int, rng: np.random.Generator
) -> DirectIndentation:
    """A capture with noise of its depths, and of displacements with errors that samples share."""
    motion, std_m = np.zeros(exact.moved_m.shape), exact.moved_std_m
    motion[exact.seen] = -residuals(exact, of).motion * std_m[exact.seen]
    apart = np.linalg.norm(exact.cell_m[:, None] - exact.cell_m, axis=2)
    root = np.linalg.cholesky(np.exp(-((apart / ALIKE_M) ** 2)) + 1e-6 * np.eye(len(apart)))
    noise, (at_rest, pattern, *_) = rng.normal(size=(2, *motion.shape)) @ root.T
    errors = std_m * (noise + at_rest / np.sqrt(rest)) + PATTERN * motion * pattern
    return replace(
        exact,
        moved_m=exact.moved_m + motion + errors,
        moved_std_m=exact.noise_std_m,
        depth_m=exact.depth_m + exact.tip_std_m * rng.normal(size=len(exact.depth_m)),
    )
