"""A long look into an object's folder: all that is wrong, what is doubtful, what is there.

`palpate.capture.check` holds the files to the format, which the workflow does before each run.
This looks at what they hold: template, board, force, depth.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.ndimage import uniform_filter1d

from palpate.capture.capture import Capture
from palpate.capture.check import checked_object
from palpate.capture.check_curves import declared_curve
from palpate.capture.discover import CURVE_END, SensorFolder, curve_files
from palpate.capture.findings import Findings, examine_force, examine_template
from palpate.capture.poses import POSES
from palpate.capture.tables import FORCE, GAUGE_COLUMNS, WRENCH_COLUMNS, read_table, sampled_s
from palpate.config.probe import as_stated
from palpate.estimate.hertz.indentation import force_onset
from palpate.measurement import align
from palpate.press import Press, press_of
from palpate.surface.alignment import Alignment
from palpate.units import MILLIMETRES
from palpate.vision.calibrated_probe import calibrated_probe, placed_sensor
from palpate.vision.examine_frames import examine_frames, examine_scene
from palpate.vision.force import AVERAGED_S, zeroed
from palpate.workflow.options import Config
from palpate.yaml_files import load_yaml

# From a declared point: what a hand misses it by.
FAR_MM = 6.0
# Texts that a person may take for curves.
TEXTS = (".txt", ".dat", ".tsv", ".asc")


def examine_object(
    folder: str | Path,
    sensors: Mapping,
    probes: Mapping,
    config: Config | None = None,
    optics_of: Callable[[str], Path | None] = lambda sensor: None,
    calibrations_of: Callable[[str], Sequence[Path]] = lambda sensor: (),
) -> Findings:
    """Look into all that was dropped in for one object.

    Parameters
    ----------
    folder : path
        ``raw/<object>``.
    sensors, probes : mapping
        Specifications by name; None of a file that is wrong, to which nothing is held.
    config : Config, optional
        The options that an estimate would have.
    optics_of : callable, optional
        Gives calibration.json of a sensor by name, where a run has made it.
    calibrations_of : callable, optional
        And those of the probe by it, and of the poses' base; of what the probe's file asks for and
        nobody made, what it states counts.

    Returns
    -------
    Findings
        Lines on contents just of those files that are right by their format.
    """
    folder = Path(folder)
    checked = checked_object(folder, sensors, probes)
    result = Findings(checked.problems)
    of_sensors = tuple(str(place.folder) for place in checked.listed)
    if any(not line.startswith(of_sensors) for line in checked.problems):
        return result
    spec = load_yaml(folder / "object.yaml")
    template = examine_template(folder, spec)
    result += template + _curves(folder, spec, probes.get(spec.get("probe")))
    for place in checked.listed:
        sensor, probe = sensors.get(place.folder.name), probes[spec["probe"]]
        if sensor is not None and probe is not None:
            made = calibrations_of(place.folder.name)
            probe = calibrated_probe(as_stated(probe, {path.stem for path in made}), made)
            placed = placed_sensor(sensor, made)
            opened = [Capture(path, spec, placed, probe) for path in place.captures]
            optics = optics_of(place.folder.name)
            # Of scans a run makes the template.
            to_align = "file" in spec["template"] and not template.wrong
            options = config or Config()
            result += _sensor(place, checked.right, opened, options, optics, to_align=to_align)
    return result


def _curves(folder: Path, spec: Mapping, probe: Mapping | None) -> Findings:
    """What an object's curves hold; those that nothing is declared of are doubtful."""
    found = curve_files(folder)
    if "curves" not in spec:
        lone = [path for path in found if path.stem.partition("-")[0] in spec["points"]]
        line = "not used: object.yaml declares no curves"
        return Findings(doubts=tuple(f"{path}: {line}" for path in lone))
    curves = {path: declared_curve(path, spec, probe) for path in found}
    doubts = [f"{path}: {line}" for path, one in curves.items() for line in one.doubts]
    others = [path for path in folder.iterdir() if path.suffix in TEXTS and path.is_file()]
    for path in sorted(others):
        if path.stem.partition("-")[0] in spec["points"]:
            doubts.append(f"{path}: not used: a curve's name ends with {CURVE_END}")
    told = tuple(f"curve {path.stem}: {one.read}" for path, one in curves.items())
    return Findings(doubts=tuple(doubts), found=told)


def _sensor(
    place: SensorFolder,
    right: frozenset[Path],
    captures: Sequence[Capture],
    config: Config,
    optics: Path | None,
    *,
    to_align: bool,
) -> Findings:
    """Look into one sensor's background and captures, as far as they are right by their format."""
    if not captures:
        return Findings((f"{place.folder}: folder: expected captures, found none",))
    result, has_background = Findings(), captures[0].background in right
    for capture in captures:
        if capture.folder in right:
            result += _capture(
                capture, config, optics, has_background=has_background, to_align=to_align
            )
    # What is wrong with a background comes up with each of its captures.
    return replace(result, wrong=tuple(dict.fromkeys(result.wrong)))


def _capture(
    capture: Capture, config: Config, optics: Path | None, *, has_background: bool, to_align: bool
) -> Findings:
    folder, found = capture.folder, Findings()
    try:
        found += examine_frames(folder, capture.sensor)
        if has_background:
            press = press_of(capture, config, optics)
            least = config.hertz.onset_force_n
            found += examine_scene(folder, capture.background, capture.sensor)
            force_onset(press.sizes_n, onset_force_n=least)
            found += _press(capture, press, config)
            if to_align:
                found += _place(capture, align(press))
    except ValueError as error:
        line = str(error)
        place = line.startswith(str(folder.parent))
        found += Findings((line if place else f"{folder}: {line}",))
    text = f"{folder.parent.name}/{folder.name}: {', '.join(found.found)}"
    return Findings(found.wrong, found.doubts, (text,))


def _place(capture: Capture, found: Alignment) -> Findings:
    """Where the template and the first contact lie."""
    declared_m = capture.declared_point["position_m"]
    away_mm = MILLIMETRES * float(np.linalg.norm(found.contact_point_m - declared_m))
    off = f"template {MILLIMETRES * found.rms_m:.1f} mm off the first cloud (rms)"
    told = (f"{off}, contact {away_mm:.1f} mm from the declared point",)
    if away_mm <= FAR_MM:
        return Findings(found=told)
    expected = f"expected within {FAR_MM:g} mm of points.{capture.point}"
    why = "force_from_tip, marker_from_force, the point?"
    line = f"{capture.folder}: contact: {expected}, found {away_mm:.1f} mm away ({why})"
    return Findings(doubts=(line,), found=told)


def _press(capture: Capture, press: Press, config: Config) -> Findings:
    """Board and force of a press that nothing speaks against."""
    seen, frames_s = press.poses["detected"], press.poses["time_s"].to_numpy(float)
    by = "poses at" if (capture.folder / POSES).is_file() else "board in"
    found = Findings(found=(f"{by} {seen.sum()} of {len(seen)} frames",))
    known = zeroed(capture.force, capture.probe, config.force.bias_window_s, frames_s[0])
    count = round(AVERAGED_S * (len(known.time_s) - 1) / np.ptp(known.time_s))
    found += examine_force(
        capture.folder,
        known.time_s,
        uniform_filter1d(known.wrench[:, :3], max(1, count), axis=0, mode="nearest"),
        known.within(known.time_s),
        frames_s + press.clock.offset_s,
        onset_n=config.hertz.onset_force_n,
    )
    offset_ms, std_ms = 1e3 * press.clock.offset_s, 1e3 * press.clock.std_s
    told = (
        *told_of(capture.folder, known.columns),
        f"offset of its clock {offset_ms:+.0f} +- {std_ms:.0f} ms"
        + " as assumed: the indentation does not determine it" * (not press.clock.determined),
    )
    return found + Findings(found=told)


def told_of(folder: Path, taken: Sequence[str]) -> Iterator[str]:
    """Say what was made of a record's stamps and of its columns, where another might be expected.

    Of a capture's folder, and the columns of force.csv that were taken.
    """
    raw = read_table(folder / FORCE)
    burst = sampled_s(raw["time_s"].to_numpy(float))[1]
    if burst > 1:
        yield f"its stamps in bursts of {burst:.0f} samples, which were spread"
    if {*GAUGE_COLUMNS, *WRENCH_COLUMNS} <= set(raw.columns):
        yield f"volts and newtons, of which {taken[0]}..{taken[-1]} were taken"
