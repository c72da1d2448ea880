"""Errors of a rig: how it differs from the files that the pipeline reads.

The ``device`` block of lab.yaml, or of an object in its place, says by how much: docs/decisions.md.
Each error has a stream of its own, so that leaving one out does not change the others.
"""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

# The rig of objects that name none.
RIG = "lab"
# Which of OpenCV's five are drawn: the first radial number and the two tangential ones.
BENT = [0, 2, 3]
# A picture is the mean of an exposure's thirds: their middles.
THIRDS = np.array([0, -1, 1]) / 3
# From the force sensor to the tip: makes newton metres of newtons.
ARM_M = 0.06
Draw = Callable[..., NDArray]


def seed_of(common: Mapping, *names: str) -> list[int]:
    """Seed of a named thing of the lab, the same in whatever order things are made."""
    return [common["seed"], *(zlib.crc32(name.encode()) for name in names)]


@dataclass(frozen=True)
class RigErrors:
    """What is drawn of a rig.

    Attributes
    ----------
    rig, sizes : str, mapping
        Its name, and its ``device`` block: error to size.
    sensor : mapping
        The sensor as it is, in the form of its file; of a stereo head also ``right``, the right
        camera, and ``right_turn_rad``, its turn (3,) after rectification.
    target : (4, 4) array
        Where the probe's target is, from where its file puts it.
    radius : float
        Error of the sphere's radius, relative.
    payload : mapping
        Errors ``mass_kg`` and ``centre_of_mass_m`` of the force sensor's payload.
    gain : (6, 6) array
        Wrench that the force sensor measures over that which acts.
    clock_rate : float
        How much faster than the camera's the force's clock goes, relative.
    """

    rig: str
    sizes: Mapping[str, float]
    sensor: Mapping
    target: NDArray
    radius: float
    payload: Mapping
    gain: NDArray
    clock_rate: float

    def size(self, error: str) -> float:
        """Size of an error, 0 where the block does not name it."""
        return self.sizes.get(error, 0)

    def drawn(
        self, error: str, rng: np.random.Generator, shape: int | tuple = ()
    ) -> NDArray | float:
        """Draw an error that belongs to a recording."""
        return self.size(error) * _deviations(self.sizes, rng, shape)

    @property
    def moments_s(self) -> NDArray:
        """Moments of a frame from its stamp: those of its colours, then one of its depth [s]."""
        exposure_s, delay_s = self.size("exposure_s"), self.size("depth_delay_s")
        colours_s = THIRDS * exposure_s if exposure_s else np.zeros(1)
        return np.append(colours_s, [delay_s] if exposure_s or delay_s else [])

    def kept(self, frames: int, rng: np.random.Generator) -> NDArray:
        """Numbers of those frames of a recording that are not lost."""
        return np.flatnonzero(rng.random(frames) >= self.size("dropped_frames"))

    def stamped(self, time_s: NDArray) -> NDArray:
        """Stamps of the force's samples, (n,) [s]: those that come at once share the last one's."""
        burst = self.size("burst") or 1
        last = np.arange(len(time_s)) // burst * burst + burst - 1
        return time_s[np.minimum(last, len(time_s) - 1)]

    def probe(self, spec: Mapping) -> dict:
        """A probe as it is, in the form of its file."""
        target = np.array(spec["marker_from_force"]) @ self.target
        radius_m = spec["indenter"]["radius_m"] * (1 + self.radius)
        indenter = spec["indenter"] | {"radius_m": radius_m}
        return dict(spec) | {"marker_from_force": target, "indenter": indenter}

    def force(self, options: Mapping) -> dict:
        """Block ``force`` of lab.yaml with the sensor's payload as it is."""
        mass_kg = options["mass_kg"] + self.payload["mass_kg"]
        centre_m = np.array(options["centre_of_mass_m"]) + self.payload["centre_of_mass_m"]
        return dict(options) | {"mass_kg": mass_kg, "centre_of_mass_m": centre_m}

    def measured(self, time_s: NDArray, wrench: NDArray, rng: np.random.Generator) -> NDArray:
        """What the force sensor makes of a wrench at times (n,) [s], shape (n, 6) [N, Nm].

        Gain and crosstalk, a first-order lag, and a drift of the forces that grows evenly.
        """
        found = wrench @ self.gain.T
        if lag_s := self.size("force_lag_s"):
            kept = np.exp(-np.diff(time_s[:2]) / lag_s)[0]
            found, _ = lfilter([1 - kept], [1, -kept], found, axis=0, zi=kept * found[:1])
        drift_n = self.drawn("force_drift_n", rng, 3)
        found[:, :3] += np.linspace(0, 1, len(found))[:, None] * drift_n
        return found


def errors_of(common: Mapping, spec: Mapping, sensor: Mapping) -> RigErrors:
    """Draw a rig's errors.

    Parameters
    ----------
    common : mapping
        lab.yaml without its objects.
    spec : mapping
        An object's block of it, of which ``device`` and ``rig`` count; empty: the lab's own.
    sensor : mapping
        The sensor's file.
    """
    draw = _draws(common, spec)
    probe = partial(draw, "probe")
    return RigErrors(
        rig=spec.get("rig", RIG),
        sizes=_sizes(common, spec),
        sensor=_sensor(sensor, partial(draw, sensor["sensor"])),
        target=_target(common, spec),
        radius=probe("radius"),
        payload={k: probe(k, shape=n) for k, n in (("mass_kg", ()), ("centre_of_mass_m", 3))},
        gain=_gain(partial(draw, "force")),
        clock_rate=draw("clock", "clock_rate"),
    )


def sphere_radius_m(common: Mapping, spec: Mapping, probe: Mapping) -> float:
    """Radius of the sphere as it is [m]; of ``common`` the seed counts alone, see `errors_of`."""
    return probe["indenter"]["radius_m"] * (1 + _draws(common, spec)("probe", "radius"))


def _sizes(common: Mapping, spec: Mapping) -> Mapping[str, float]:
    return spec.get("device", common.get("device", {}))


def _draws(common: Mapping, spec: Mapping) -> Draw:
    """Draws of a rig by part, error and, where a part has some, piece of it."""
    sizes, rig = _sizes(common, spec), spec.get("rig", RIG)

    def draw(part: str, error: str, *piece: str, shape: int | tuple = ()) -> NDArray:
        if not sizes.get(error):
            return np.zeros(shape)
        rng = np.random.default_rng(seed_of(common, "rig", rig, part, error, *piece))
        return sizes[error] * _deviations(sizes, rng, shape)

    return draw


def _deviations(
    sizes: Mapping, rng: np.random.Generator, shape: int | tuple = ()
) -> NDArray | float:
    drawn = rng.standard_normal(shape)
    return np.sign(drawn) if sizes.get("signs_alone") else drawn


def _target(common: Mapping, spec: Mapping) -> NDArray:
    options, rig = common["probe_error"], spec.get("rig", RIG)
    named = [common["seed"], 25] if rig == RIG else seed_of(common, "rig", rig, "probe", "board")
    rng = np.random.default_rng(named)
    error = np.eye(4)
    turn = np.deg2rad(options["angle_deg"]) * rng.standard_normal(3)
    error[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    error[:3, 3] = options["shift_m"] * rng.standard_normal(3)
    return error


def _gain(draw: Draw) -> NDArray:
    """Gain of each axis and crosstalk; between forces and torques over the probe's arm."""
    crosstalk = draw("force_crosstalk", shape=(6, 6))
    np.fill_diagonal(crosstalk, draw("force_gain", shape=6))
    scale = np.repeat([1, ARM_M], 3)
    return np.eye(6) + crosstalk * scale[:, None] / scale


def _sensor(sensor: Mapping, draw: Draw) -> dict:
    real = dict(sensor) | {"color": _optics(sensor["color"], draw, "color")}
    f_px, baseline = sensor["color"]["fx_px"], 1 + draw("baseline")
    if sensor["kind"] == "stereo":
        # A rectified pair has one focal length and middle; its lenses are two.
        bent = _optics(sensor["color"], draw, "right")["distortion"]
        turn = draw("rectification_px", shape=3) / f_px
        stereo = sensor["stereo"] | {"baseline_m": sensor["stereo"]["baseline_m"] * baseline}
        return real | {
            "right": real["color"] | {"distortion": bent},
            "right_turn_rad": turn / [1, 1, _corner(sensor["color"])],
            "stereo": stereo,
        }
    stated = sensor["depth"]
    pose = np.eye(4)
    turn = np.deg2rad(draw("color_from_depth_deg", shape=3))
    pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    pose[:3, 3] = draw("color_from_depth_m", shape=3)
    depth = _optics(stated, draw, "depth") | {
        "baseline_m": stated["baseline_m"] * baseline,
        # With these a camera that reports depths makes them of what it matched.
        "stated_product_px_m": stated["fx_px"] * stated["baseline_m"],
        "color_from_depth": np.array(stated["color_from_depth"]) @ pose,
    }
    return real | {"depth": depth}


def _optics(stated: Mapping, draw: Draw, stream: str) -> dict:
    """A camera's block of the sensor's file, as the camera is."""
    focal, (x_px, y_px) = 1 + draw("focal", stream), draw("principal_px", stream, shape=2)
    corner = _corner(stated)
    bend = draw("distortion_px", stream, shape=3) / stated["fx_px"]
    distortion = np.array(stated.get("distortion", np.zeros(5)), dtype=float)
    distortion[BENT] += bend / [corner**3, 3 * corner**2, 3 * corner**2]
    middle = {"cx_px": stated["cx_px"] + x_px, "cy_px": stated["cy_px"] + y_px}
    lengths = {key: stated[key] * focal for key in ("fx_px", "fy_px")}
    return dict(stated) | lengths | middle | {"distortion": distortion.tolist()}


def _corner(camera: Mapping) -> float:
    """Tangent of the angle between a camera's axis and the corner of its picture."""
    return float(np.hypot(camera["width_px"], camera["height_px"])) / (2 * camera["fx_px"])
