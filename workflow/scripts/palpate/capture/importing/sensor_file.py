"""The sensor's file of an imported recording: made from its optics, or held to them."""

from collections.abc import Mapping
from pathlib import Path

import yaml

from palpate.capture.files import whole_file
from palpate.capture.importing.optics import agree
from palpate.capture.importing.pixels import stored_depth
from palpate.capture.importing.recording import Content
from palpate.config.model import blank_fields, problems
from palpate.config.sensor import SensorSpec
from palpate.yaml_files import load_yaml

# Depth cameras differ; what is seen is bounded by mask and table, not by this.
RANGE_M = (0.1, 10.0)
# The study's for its Kinect (Section 4.2.3).
REPROJECTION_THRESHOLD_PX = 0.45
HEAD = """\
# Made by an import: the optics are those that the recording states. range_m and
# reprojection_threshold_px are no part of recordings: look them over.
"""


def sensor_of(
    path: Path, content: Content, rate_hz: float, *, range_m=RANGE_M, trusted: bool = False
) -> tuple[dict, bool]:
    """Specification of a recording's sensor: its file's, or a new one.

    Parameters
    ----------
    path : Path
        ``config/sensors/<sensor>.yaml``; fields left to fill in are taken from the recording.
    content : Content
        What the recording holds.
    rate_hz : float
        Frames per second.
    range_m : pair of floats, optional
        Nearest and farthest depth of a new file [m].
    trusted : bool, optional
        Whether the file's optics are right whatever the recording states.

    Returns
    -------
    spec : dict
    new : bool
        Whether the file is to be written: none is there, or one with fields left to fill in.

    Raises
    ------
    ValueError
        If the file is wrong or contradicts the recording, or there is neither file nor optics.
    """
    if path.exists():
        written = load_yaml(path)
        spec = SensorSpec.plain(_filled_in(written, _stated(path, content, rate_hz, range_m)))
        _require_valid(spec, path)
        _check_streams(spec, content, path)
        if not trusted and spec.get("optics", "stated") == "stated":
            _check_optics(spec, content.cameras or {}, path)
        return spec, spec != written
    if content.cameras is None:
        expected = "a sensor file, or optics in the recording (camera_info, --intrinsics)"
        raise ValueError(f"{path}: file: expected {expected}, found neither")
    spec = _stated(path, content, rate_hz, range_m)
    _require_valid(spec, path)
    return spec, True


def _stated(path: Path, content: Content, rate_hz: float, range_m) -> dict:
    """What a recording says of its sensor, and what a new file has besides."""
    cameras = dict(content.cameras or {})
    if "depth" in cameras:
        cameras["depth"] |= stored_depth(content.depth.form, content.depth_unit_m)
    return {
        "sensor": path.stem,
        "kind": "depth",
        "frame_rate_hz": float(f"{rate_hz:.4g}"),
        "range_m": [float(value) for value in range_m],
        **cameras,
        "marker": {"reprojection_threshold_px": REPROJECTION_THRESHOLD_PX},
    }


def _filled_in(written: object, stated: object) -> object:
    """A file's content with what is left to fill in taken from the recording."""
    if isinstance(written, Mapping) and isinstance(stated, Mapping):
        return {k: _filled_in(v, stated[k]) if k in stated else v for k, v in written.items()}
    return stated if blank_fields(written) else written


def write_sensor(path: Path, spec: Mapping) -> None:
    """Write a sensor's file whole or not at all."""
    text = yaml.safe_dump(dict(spec), sort_keys=False, default_flow_style=None, width=100)
    with whole_file(path) as part:
        part.write_text(HEAD + text, encoding="utf-8")


def _require_valid(spec: object, path: Path) -> None:
    if lines := problems(SensorSpec, spec, str(path)):
        raise ValueError(lines[0])


def _check_streams(spec: Mapping, content: Content, path: Path) -> None:
    if spec["kind"] != "depth":
        found = f"{spec['kind']} (another name in raw/ gives it a file of its own)"
        raise ValueError(f"{path}: kind: expected depth, as the recording is, found {found}")
    for kind in ("color", "depth"):
        form = getattr(content, kind).form
        sizes = {"width_px": form.width_px, "height_px": form.height_px}
        # Depths are rounded to the file's counts.
        sizes |= {} if form.is_depth else {"encoding": form.stored}
        for name, expected in sizes.items():
            if spec[kind][name] != expected:
                line = f"expected {expected}, as the recording has it, found {spec[kind][name]}"
                raise ValueError(f"{path}: {kind}.{name}: {line}")


def _check_optics(spec: Mapping, cameras: Mapping, path: Path) -> None:
    for kind, found in cameras.items():
        difference = agree(spec[kind], found)
        if difference:
            hint = "(--trust-sensor-file takes the file's)"
            raise ValueError(f"{path}: {kind}.{difference} {hint}")
