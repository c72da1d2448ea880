"""A long look into an object's folder: all that is wrong, what needs a look, what is there.

`palpate.capture.check` holds the files to the format, which the workflow does before each run.
This looks at what they hold: template, board, force, depth.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import uniform_filter1d

from palpate.capture.capture import Capture
from palpate.capture.check import checked_object, declared_curve
from palpate.capture.discover import CURVE_END, SensorFolder, curve_files
from palpate.capture.findings import Findings, examine_force, examine_template
from palpate.capture.images import Stream, depth_of, grey
from palpate.capture.poses import POSES
from palpate.capture.tables import (
    FORCE,
    FRAMES,
    GAUGE_COLUMNS,
    WRENCH_COLUMNS,
    read_frames,
    read_table,
    sampled_s,
)
from palpate.config.probe import as_stated
from palpate.estimate.hertz.indentation import force_onset
from palpate.measurement import align
from palpate.press import Press, press_of
from palpate.surface.alignment import Alignment
from palpate.units import MILLIMETRES
from palpate.vision.calibrated_probe import calibrated_probe, placed_sensor
from palpate.vision.clouds import scene_cloud
from palpate.vision.force import AVERAGED_S, zeroed
from palpate.workflow.options import Config
from palpate.yaml_files import load_yaml

# From a declared point: what a hand misses it by.
FAR_MM = 6.0
# Texts that a person may take for curves.
TEXTS = (".txt", ".dat", ".tsv", ".asc")
# A frame's grey levels.
DARKEST, BRIGHTEST, BLACK = 15, 240, 1
# Grey levels that tell a thing from the background, and parts of the picture it takes.
CHANGED, BLUR_PX = 20, 7
LEAST_CHANGED, MOST_CHANGED, ALL_CHANGED = 0.003, 0.6, 0.95
# Of the usual time between frames, and of the camera's rate; a recording may keep each nth frame
# only, so that no rate is too low.
LONGEST_GAP, FASTEST = 3.0, 1.2
LEAST_DEPTH_SHARE = 0.3


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
    optics_of, calibrations_of : callable, optional
        Give calibration.json of a sensor by name, where a run has made it, and those of the probe
        by it, and of the poses' base; of what the probe's file asks for and nobody made, what it
        states counts.

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
            # Of scans a run makes the template.
            to_align = "file" in spec["template"] and not template.wrong
            of = {"config": config or Config(), "optics": optics_of(place.folder.name)}
            look = partial(_capture, **of, to_align=to_align)
            result += _sensor(place, checked.right, opened, look)
    return result


def _curves(folder: Path, spec: Mapping, probe: Mapping | None) -> Findings:
    """What an object's curves hold; those that nothing is declared of need a look."""
    found = curve_files(folder)

    def unused(paths: Iterable[Path], why: str) -> list[str]:
        named = [path for path in paths if path.stem.partition("-")[0] in spec["points"]]
        return [f"{path}: not used: {why}" for path in named]

    if "curves" not in spec:
        return Findings(warnings=tuple(unused(found, "object.yaml declares no curves")))
    curves = {path: declared_curve(path, spec, probe) for path in found}
    warnings = [f"{path}: {line}" for path, one in curves.items() for line in one.warnings]
    texts = sorted(path for path in folder.iterdir() if path.suffix in TEXTS and path.is_file())
    warnings += unused(texts, f"a curve's name ends with {CURVE_END}")
    found = tuple(f"curve {path.stem}: {one.read}" for path, one in curves.items())
    return Findings(warnings=tuple(warnings), found=found)


def _sensor(
    place: SensorFolder, right: frozenset[Path], captures: Sequence[Capture], look: Callable
) -> Findings:
    """Look into one sensor's background and captures, as far as they are right by their format."""
    if not captures:
        return Findings((f"{place.folder}: folder: expected captures, found none",))
    result = Findings()
    for capture in captures:
        if capture.folder in right:
            result += look(capture, has_background=capture.background in right)
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
            found += examine_scene(folder, capture.background, capture.sensor)
            force_onset(press.sizes_n, onset_force_n=config.hertz.onset_force_n)
            found += _press(capture, press, config)
            if to_align:
                found += _place(capture, align(press))
    except ValueError as error:
        line = str(error)
        place = line.startswith(str(folder.parent))
        found += Findings((line if place else f"{folder}: {line}",))
    sentences = " ".join(f"{one[0].upper()}{one[1:]}." for one in found.found)
    text = f"{folder.parent.name}/{folder.name}: {sentences}"
    return Findings(found.wrong, found.warnings, (text,))


def _place(capture: Capture, found: Alignment) -> Findings:
    """Where the template and the first contact lie."""
    declared_m = capture.declared_point["position_m"]
    away_mm = MILLIMETRES * float(np.linalg.norm(found.contact_point_m - declared_m))
    off = f"the first cloud is {MILLIMETRES * found.rms_m:.1f} mm off the template (rms)"
    lines = off, f"the probe touches {away_mm:.1f} mm from the declared point"
    if away_mm <= FAR_MM:
        return Findings(found=lines)
    expected = f"expected within {FAR_MM:g} mm of points.{capture.point}"
    why = "force_from_tip, marker_from_force, the point?"
    line = f"{capture.folder}: contact: {expected}, found {away_mm:.1f} mm away ({why})"
    return Findings(warnings=(line,), found=lines)


def _press(capture: Capture, press: Press, config: Config) -> Findings:
    """Board and force of a press that nothing speaks against."""
    seen, frames_s = press.poses["detected"], press.poses["time_s"].to_numpy(float)
    by = "the probe has a pose" if (capture.folder / POSES).is_file() else "the target is found"
    found = Findings(found=(f"{by} in {seen.sum()} of {len(seen)} frames",))
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
    clock = f"its clock is {offset_ms:+.0f} +- {std_ms:.0f} ms off the camera's"
    if not press.clock.determined:
        clock += ", by the sensor's file: right if both clocks agree to within that"
    return found + Findings(found=(*told_of(capture.folder, known.columns), clock))


def told_of(folder: Path, taken: Sequence[str]) -> Iterator[str]:
    """Say what was made of a record's stamps, and of its columns, of which some were ``taken``."""
    raw = read_table(folder / FORCE)
    burst = sampled_s(raw["time_s"].to_numpy(float))[1]
    if burst > 1:
        yield f"its times came in bursts of {burst:.0f} samples and were spread evenly"
    if {*GAUGE_COLUMNS, *WRENCH_COLUMNS} <= set(raw.columns):
        yield f"it has volts and newtons, of which {taken[0]}..{taken[-1]} were taken"


def examine_frames(folder: Path, sensor: Mapping) -> Findings:
    """Look into a capture's frames, whose images are right by their size and kind."""
    first = Stream(folder, sensor)[0]
    if sensor["kind"] == "cloud":
        count, seen = (len(one.points_m) for one in (first, scene_cloud({"cloud": first}, sensor)))
        kind = f"points with{'' if first.normals is not None else 'out'} normals"
        return _timing(folder, sensor, f"{count} {kind}, {seen / count:.0%} of them in range")
    first = grey(first)
    found = _timing(folder, sensor, f"{first.shape[1]} x {first.shape[0]} px")
    level = float(first.mean())
    if not DARKEST <= level <= BRIGHTEST:
        expected = f"grey levels of {DARKEST} to {BRIGHTEST} on average"
        found += _seldom(f"{folder}: frames", expected, f"{level:.0f}", wrong=level < BLACK)
    return found + (_depths(folder, sensor) if "depth" in sensor else Findings())


def examine_scene(folder: Path, background: Path, sensor: Mapping) -> Findings:
    """Whether a capture's first frame shows something new, and the scene is the background's."""
    if sensor["kind"] == "cloud":
        return Findings()
    images = (grey(Stream(place, sensor)[0]) for place in (folder, background))
    smooth = [cv2.blur(image, (BLUR_PX, BLUR_PX)).astype(int) for image in images]
    share = float((np.abs(smooth[0] - smooth[1]) > CHANGED).mean())
    if LEAST_CHANGED <= share <= MOST_CHANGED:
        return Findings(found=(f"{share:.0%} of the picture is new against the background",))
    expected = "the background's scene (same place, same light)"
    found = f"{share:.0%} of the picture changed"
    if share < LEAST_CHANGED:
        expected = "object and probe, which the background must not hold"
        found = f"{share:.2%} of the picture changed"
    return _seldom(f"{folder}: frames", expected, found, wrong=share > ALL_CHANGED)


def _seldom(place: str, expected: str, found: str, *, wrong: bool = False) -> Findings:
    """A line on what is wrong, or seldom right."""
    line = f"{place}: expected {expected}, found {found}"
    return Findings((line,)) if wrong else Findings(warnings=(line,))


def _timing(folder: Path, sensor: Mapping, size: str) -> Findings:
    time = read_frames(folder)["time_s"].to_numpy(float)
    steps, place = np.diff(time), f"{folder / FRAMES}: time_s"
    usual, longest, most_hz = float(np.median(steps)), float(steps.max()), sensor["frame_rate_hz"]
    rate = f"{len(time)} frames over {time[-1] - time[0]:.2f} s ({1 / usual:.1f} Hz)"
    found = Findings(found=(f"{rate}, {size}",))
    if longest > LONGEST_GAP * usual:
        found += _seldom(place, f"frames about {usual:.3f} s apart", f"a gap of {longest:.2f} s")
    if 1 / usual > FASTEST * most_hz:
        expected = f"at most {most_hz:g} Hz (the sensor's frame_rate_hz)"
        found += _seldom(place, expected, f"{1 / usual:.1f} Hz")
    return found


def _depths(folder: Path, sensor: Mapping) -> Findings:
    """Depths of the first frame's middle against the sensor's range."""
    depth = depth_of(Stream(folder, sensor, "depth")[0], sensor["depth"])
    h, w = depth.shape
    middle = depth[h // 4 : -(h // 4), w // 4 : -(w // 4)]
    known, (low, high), place = np.isfinite(middle), sensor["range_m"], f"{folder}: depth"
    if not known.any():
        return _seldom(place, "readings in the middle", "none", wrong=True)
    typical, share = float(np.median(middle[known])), float(known.mean())
    if not low <= typical <= high:
        expected = f"{low:g} to {high:g} m (the sensor's range_m)"
        unit_m = sensor["depth"].get("count_m")
        why = f"depth.count_m {unit_m:g}" if unit_m else "what does a count stand for"
        found = f"{typical:.3g} m in the middle ({why}?)"
        return _seldom(place, expected, found, wrong=True)
    result = Findings(found=(f"depth is known in {share:.0%} of the middle, {typical:.2f} m",))
    if share < LEAST_DEPTH_SHARE:
        expected = f"readings in {LEAST_DEPTH_SHARE:.0%} of the middle or more"
        result += _seldom(place, expected, f"{share:.0%}")
    return result
