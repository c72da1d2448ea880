"""How an operator moves the probe: rest, approach, loading, hold, release; tilt and tremor."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from virtual_lab.obstacle import DOWN

# An operator's tremor lies below about ten hertz.
TREMOR_HZ = (0.6, 9.0)
TREMOR_TONES = 12
HOVER_M = 0.001
RAMP = 0.15


@dataclass(frozen=True)
class ProbeMotion:
    """Path of the probe at given times, object frame.

    Attributes
    ----------
    time_s : (n,) array
    depth_m : (n,) array
        How far the sphere went since it first touched, negative before [m].
    tip_m : (n, 3) array
        Centre of the sphere [m].
    object_from_force : (n, 3, 3) array
        Rotation of the probe.
    """

    time_s: NDArray
    depth_m: NDArray
    tip_m: NDArray
    object_from_force: NDArray


class Operator:
    """Who moves the probe in one recording, as a function of time.

    Parameters
    ----------
    options : mapping
        ``motion`` block of lab.yaml.
    point_m : (3,) array
        Foremost point of the sphere when it first touches, object frame [m].
    radius_m : float
        Radius of the sphere [m].
    direction : (3,) array, optional
        Of the indentation, of length 1.
    facing : (3,) array
        Horizontal unit vector from the object to the camera; the marker faces it.
    rng : numpy.random.Generator
        Draws the tilt, the tremor, the pace and the depth.
    """

    def __init__(
        self,
        options: Mapping,
        *,
        point_m: NDArray,
        radius_m: float,
        direction: NDArray | tuple[float, ...] = DOWN,
        facing: NDArray,
        rng: np.random.Generator,
    ) -> None:
        self.options, self.radius_m = options, radius_m
        self.point_m, self.facing = np.asarray(point_m), np.asarray(facing)
        self.turn = _turn_to(direction)
        self.tilt_rad = np.deg2rad(options["tilt_deg"]) * rng.uniform(-1, 1, 2)
        self.tones = Tones(rng, channels=5)
        self.pace = 1 + options["pace_spread"] * rng.uniform(-1, 1)
        self.depth_m = options["depth_m"] * (1 - options["depth_spread"] * rng.uniform(0, 1))

    @property
    def frames(self) -> int:
        """Frames of the recording: as many as ``frames`` says, else until the motion ends."""
        o = self.options
        moving_s = (o["press_s"] + o.get("release_s", 0)) * self.pace
        stop_s = o["rest_s"] + o["approach_s"] + moving_s + o.get("hold_s", 0)
        return o.get("frames", int(stop_s * o["frame_rate_hz"]) + 1)

    def at(self, time_s: NDArray) -> ProbeMotion:
        """Where the probe is at times [s]."""
        time_s = np.asarray(time_s, dtype=float)
        o, tremor = self.options, self.tones(time_s)
        depth = self._depth(time_s)
        free = np.clip(-depth / o["approach_m"], 0, 1)
        depth = depth + tremor[:, 0] * o["depth_tremor_m"] * np.clip(depth / HOVER_M, 0, 1)
        shaking = o["lateral_tremor_m"] * free + o.get("contact_tremor_m", 0) * (1 - free)
        sideways = tremor[:, 1:3] * shaking[:, None]
        tip = self.point_m + np.column_stack([sideways, self.radius_m - depth]) @ self.turn.T
        tilt = self.tilt_rad + tremor[:, 3:5] * np.deg2rad(o["tilt_tremor_deg"])
        return ProbeMotion(time_s, depth, tip, self.turn @ upright(self.facing, tilt))

    def _depth(self, time_s: NDArray) -> NDArray:
        o = self.options
        start = o["rest_s"]
        approach = _minimum_jerk((time_s - start) / o["approach_s"])
        loading_s = time_s - start - o["approach_s"]
        share = _ramped(loading_s / (o["press_s"] * self.pace))
        if "release_s" in o:
            released_s = loading_s - o["press_s"] * self.pace - o["hold_s"]
            share = share - _ramped(released_s / (o["release_s"] * self.pace))
        above = o["approach_m"] - HOVER_M
        return -o["approach_m"] + above * approach + (self.depth_m + HOVER_M) * share


def upright(facing: NDArray, tilt_rad: NDArray) -> NDArray:
    """Rotations of a probe that points down with its marker to a side, tilted, (n, 3, 3).

    Parameters
    ----------
    facing : (3,) array
        Horizontal unit vector that the marker looks along.
    tilt_rad : (n, 2) array
        Rotation vectors about the object's x and y [rad].
    """
    untilted = np.column_stack([np.cross(facing, DOWN), facing, DOWN])
    vectors = np.column_stack([tilt_rad, np.zeros(len(tilt_rad))])
    return Rotation.from_rotvec(vectors).as_matrix() @ untilted


def _turn_to(direction: NDArray) -> NDArray:
    """Rotation that takes straight down to a direction by the smallest angle, (3, 3)."""
    axis = np.cross(DOWN, direction)
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, np.dot(DOWN, direction))
    return Rotation.from_rotvec(axis * (angle / max(sine, 1e-12))).as_matrix()


class Tones:
    """Sum of sinusoids of random frequency and phase, unit standard deviation in each channel."""

    def __init__(self, rng: np.random.Generator, *, channels: int) -> None:
        size = (TREMOR_TONES, channels)
        self.frequency_hz = np.exp(rng.uniform(*np.log(TREMOR_HZ), size))
        self.phase = rng.uniform(0, 2 * np.pi, size)

    def __call__(self, time_s: NDArray) -> NDArray:
        """Values at times (n,) [s], (n, channels)."""
        angle = 2 * np.pi * self.frequency_hz * time_s[:, None, None] + self.phase
        return np.sin(angle).sum(axis=1) * np.sqrt(2 / TREMOR_TONES)


def _minimum_jerk(s: NDArray) -> NDArray:
    s = np.clip(s, 0, 1)
    return s**3 * (10 - 15 * s + 6 * s**2)


def _ramped(s: NDArray) -> NDArray:
    """From 0 to 1 at constant speed but for smooth ramps at both ends."""
    grid = np.linspace(0, 1, 2001)
    speed = _minimum_jerk(np.minimum(grid, 1 - grid) / RAMP)
    path = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2)])
    return np.interp(s, grid, path / path[-1])
