"""Entries of YAML files: object.yaml, the sensor's, the probe's and the configuration."""

from itertools import pairwise

from corrupted import edits as to
from corrupted.places import BLOCK, COW

NAN, INF = float("nan"), float("inf")


def _added(text):
    return to.content(lambda old: old + text.encode())


def _laughs():
    """Lists, each of nine times the one before."""
    rows = [f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in pairwise("abcdefghij")]
    return _added('a: &a ["lol"]\n' + "".join(rows))


def _as_texts(value):
    if isinstance(value, dict):
        return {key: _as_texts(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_as_texts(part) for part in value]
    return str(value) if isinstance(value, int | float) else value


# YAML that is none, that grows when it is read, or that wants to be more than values.
TEXTS = {
    "billion laughs": _laughs(),
    "a Python object": _added("extra: !!python/object/apply:os.system ['touch escaped']\n"),
    "two documents": _added("---\nextra: 1\n"),
    "an escape sequence in a key": _added('"\\e[31mred": 1\n'),
    "an unknown field": _added("colour: red\n"),
    "a key twice": to.content(lambda c: c + c.split(b"\n")[0] + b"\n"),
    "zero bytes": to.holds(b""),
    "a list": to.holds(b"[1, 2]\n"),
    "30 MB": to.holds(b"- 1\n" * 7_500_000),
    "CRLF": to.content(lambda c: c.replace(b"\n", b"\r\n")),
    "BOM": to.content(lambda c: b"\xef\xbb\xbf" + c),
    "numbers in quotes": to.fields(_as_texts),
    "a pipe": to.pipe,
    "lost": to.gone,
}
OF_OBJECT = {
    "another object": to.put("object", "foam_ball"),
    "an object called lab": to.both(
        to.put("object", "lab"), to.beside("../foam_block", to.named("lab"))
    ),
    "an unknown probe": to.put("probe", "needle"),
    "template.file elsewhere": to.put("template.file", "../../../../etc/passwd"),
    "template.file of another kind": to.put("template.file", "template.glb"),
    "template.file not there": to.put("template.file", "other.ply"),
    "plane_normal of zeros": to.put("support.plane_normal", [0, 0, 0]),
    "plane_point_m 10 mm low": to.put("support.plane_point_m", [0, 0, -0.01]),
    "tolerance_m NaN": to.put("support.tolerance_m", NAN),
    "a point's key without quotes": to.content(lambda c: c.replace(b"'01':", b"01:")),
    "a point called background": to.put(
        "points.background", {"position_m": [-0.25, -0.05, 0.0475]}
    ),
    "point in mm": to.times("points.08.position_m", 1e3),
    "point at the far corner": to.put("points.08.position_m", [0.25, 0.05, 0.0475]),
    "direction of 1e-320": to.put("points.08.direction", [0, 0, -1e-320]),
}
OF_SENSOR = {name: TEXTS[name] for name in ("a list", "CRLF", "numbers in quotes", "lost")} | {
    "kind sonar": to.put("kind", "sonar"),
    "another sensor": to.put("sensor", "kinnect"),
    "color.fx_px x 1.1": to.times("color.fx_px", 1.1),
    "color.cx_px beside the image": to.put("color.cx_px", -3),
    "color.width_px 320": to.put("color.width_px", 320),
    "color.encoding mono8": to.put("color.encoding", "mono8"),
    "depth.encoding millimetre": to.put("depth.encoding", "millimetre"),
    "depth.baseline_m x 0.5": to.times("depth.baseline_m", 0.5),
    "depth.no_reading 0": to.put("depth.no_reading", 0),
    "depth.color_from_depth in mm": to.put("depth.color_from_depth.0.3", -25.0),
    "depth.color_from_depth 1 m": to.put("depth.color_from_depth.0.3", -1.0),
}
OF_PROBE = {
    name: TEXTS[name] for name in ("a Python object", "BOM", "an unknown field", "lost")
} | {
    "indenter.radius_m x 1000": to.times("indenter.radius_m", 1e3),
    "indenter.radius_m the diameter": to.times("indenter.radius_m", 2),
    "indenter.radius_m x 1.1": to.times("indenter.radius_m", 1.1),
    "marker.square_m x 1.02": to.times("marker.square_m", 1.02),
    "marker.inner_corners of another target": to.put("marker.inner_corners", [6, 5]),
    "marker_from_force in mm": to.put("marker_from_force.0.3", 30.0),
    "marker_from_force mirrored": to.times("marker_from_force.2", [-1.0, -1, -1, 1]),
    "marker_from_force a shift flipped": to.times("marker_from_force.1.3", -1),
    "force_from_tip 20 mm short": to.put("force_from_tip.2.3", 0.04),
    "force_from_tip aside": to.put("force_from_tip.0.3", 0.02),
    "load.mass_kg 0.3": to.put("load.mass_kg", 0.3),
    "no gauge": to.lost("gauge"),
    "gauge.calibration with a row twice": to.put(
        "gauge.calibration", lambda rows: [*rows[:4], rows[1], rows[5]]
    ),
}
OPTIONS = {
    "an unknown option": to.put("hertz.colour", "red"),
    "hertz lost": to.lost("hertz"),
    **{f"hertz.onset_force_n {value!r}": to.put("hertz.onset_force_n", value)
       for value in (-0.1, NAN, INF, "0.1 N", True, 1e30)},
    "tracking.estimate_from unknown": to.put("tracking.estimate_from", "other"),
    "tracking.trackers like itself": to.put("tracking.trackers.mine", {"like": "mine"}),
    "only an unknown object": to.put("only", "sponge"),
    "paths.raw not there": to.put("paths.raw", "/nowhere"),
    "paths.results ./raw/": to.put("paths.results", "./raw/"),
    "paths.lab not there": to.put("paths.lab", "lab.yaml"),
}  # fmt: skip
ENTRIES = {
    f"{BLOCK}/object.yaml": TEXTS | OF_OBJECT,
    "config/sensors/kinect.yaml": OF_SENSOR,
    "config/probes/nano25_sphere.yaml": OF_PROBE,
    "config.yaml": OPTIONS,
    f"{COW}/object.yaml": {"template.unit mm": to.put("template.unit", "mm")},
    "config/probes/bench_probe.yaml": {
        "marker.inner_corners exchanged": to.put("marker.inner_corners", [3, 4]),
        "marker.square_m x 1.25": to.times("marker.square_m", 1.25),
    },
}
