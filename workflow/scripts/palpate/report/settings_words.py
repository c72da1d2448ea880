"""What results follow from: versions and options of a run; probe, mesh, files of an object."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import yaml

from palpate.markdown import rows_of
from palpate.report.held import Held
from palpate.report.style import sensor_name
from palpate.solid.indentation_table import IndentationModel
from palpate.units import MILLIMETRES

HOLDS = {"bonded": "bonded to its base", "resting": "unbonded: it only stands there"}


def describe(config: Mapping, versions: Mapping[str, str]) -> str:
    """Configuration and versions as Markdown, the same text for the same run.

    The configuration is that in force, after all overrides; versions stand in their order.
    """
    lines = ["# Configuration and versions", "", "## Versions", ""]
    lines += [*rows_of(("package", "version"), versions.items()), "", "## Configuration", ""]
    return "\n".join([*lines, "```yaml", as_yaml(config), "```", ""])


def rests_on(
    spec: Mapping,
    probe: Mapping,
    quality: Mapping,
    sensors: Sequence[Mapping],
    held: Sequence[Held],
    tables: Mapping[str, IndentationModel],
    version: str,
) -> list[dict[str, str]]:
    """Rows of a table of what an estimate was made with.

    Of object.yaml, the files of the probe and the sensors, solid_quality.json, the captures, the
    indentation tables by point, and Palpate's version.
    """
    indenter, support = probe["indenter"], spec["support"]
    radius = f"{indenter['radius_m'] * MILLIMETRES:g} mm"
    cameras, presses = [], []
    for sensor in sensors:
        mine = [one for one in held if one.capture["sensor"] == sensor["sensor"]]
        cameras.append(_camera(sensor, mine))
        if mine:
            presses.append(f"{sensor_name(sensor['sensor'])}: {_presses(mine)}")
    stands = HOLDS[support.get("contact", "bonded")]
    rows = {
        "probe": f"{probe['probe']}: {indenter['shape'].replace('_', ' ')} of radius {radius}",
        "camera": "; ".join(cameras),
        "indentations": "; ".join(presses),
        "template": f"{spec['template'].get('file', 'made of its scans')}",
        "solid mesh": f"{quality['nodes']} nodes, {quality['elements']} tetrahedra, at most"
        f" {quality['largest_gap_m'] * MILLIMETRES:.1f} mm from the template",
        "indentation table": "; ".join(f"{p}: {_table(one)}" for p, one in tables.items()),
        "support": f"{stands}; plane through {_place(support['plane_point_m'])}",
        "points": "; ".join(
            f"{name} at {_place(spec['points'][name]['position_m'])}" for name in tables
        ),
        "Palpate": version,
    }
    return [{"setting": name, "value": told} for name, told in rows.items()]


def _camera(sensor: Mapping, held: Sequence[Held]) -> str:
    size = "clouds without pictures"
    if color := sensor.get("color"):
        size = f"{color['width_px']} x {color['height_px']} pixels"
    told = f"{sensor_name(sensor['sensor'])} ({sensor['kind'].replace('_', ' ')}), {size}"
    if not held:
        return told
    rate, away = _between([one.rate_hz for one in held]), _between([o.distance_m for o in held], 2)
    return f"{told}, {rate} frames a second, {away} m from the tip at maximum depth"


def _presses(held: Sequence[Held]) -> str:
    frames = _between([len(one.time_s) for one in held], 0)
    loading = _between([one.seconds_to(np.inf) for one in held])
    hold = _between([one.hold_s for one in held])
    return f"{len(held)}, of {frames} frames; {loading} s to maximum depth, held for {hold} s"


def _table(one: IndentationModel) -> str:
    ratios = ", ".join(f"{ratio:g}" for ratio in one.poisson_ratios)
    deepest = one.depth_m[-1]
    radii = deepest / one.radius_m
    return f"to {deepest * MILLIMETRES:.1f} mm ({radii:.2f} radii), at nu {ratios}"


def _between(values: Sequence[float], places: int = 1) -> str:
    """Values from the least to the greatest, as one where they are read alike."""
    ends = [f"{end:.{places}f}" for end in (min(values), max(values))]
    return " to ".join(dict.fromkeys(ends))


def checksums(named: Mapping[str, str]) -> list[dict[str, str]]:
    """SHA-256 of files, and of folders' visible files with their names.

    Paths are by what they are called on the page.
    """
    return [{"file": name, "SHA-256": _checksum(Path(path))} for name, path in named.items()]


def _checksum(path: Path) -> str:
    if path.is_file():
        return hashlib.sha256(path.read_bytes()).hexdigest()
    whole = hashlib.sha256()
    for file in sorted(path.rglob("*")):
        name = file.relative_to(path)
        if file.is_file() and not any(part.startswith(".") for part in name.parts):
            whole.update(f"{name.as_posix()}\n".encode())
            whole.update(hashlib.sha256(file.read_bytes()).digest())
    return whole.hexdigest()


def _place(position_m: Sequence[float]) -> str:
    return "(" + ", ".join(f"{MILLIMETRES * x:.1f}" for x in position_m) + ") mm"


def as_yaml(content: Mapping) -> str:
    """YAML of a file or of options."""
    # Snakemake's own mappings are none that YAML knows.
    plain = json.loads(
        json.dumps(content, default=lambda one: dict(one) if isinstance(one, Mapping) else str(one))
    )
    return yaml.safe_dump(plain, sort_keys=False, width=96, allow_unicode=True).rstrip()
