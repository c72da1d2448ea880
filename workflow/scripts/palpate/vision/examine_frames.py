"""Whether a capture's pictures, or clouds, show the object and plausible depths, in time."""

from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np

from palpate.capture.findings import Findings
from palpate.capture.images import Stream, depth_of, grey
from palpate.capture.tables import FRAMES, read_frames
from palpate.vision.clouds import scene_cloud

# A frame's grey levels.
DARKEST, BRIGHTEST, BLACK = 15, 240, 1
# Grey levels that tell a thing from the background, and parts of the picture it takes.
CHANGED, BLUR_PX = 20, 7
LEAST_CHANGED, MOST_CHANGED, ALL_CHANGED = 0.003, 0.6, 0.95
# Times the usual time between frames.
LONGEST_GAP = 3.0
LEAST_DEPTH_SHARE = 0.3


def examine_frames(folder: Path, sensor: Mapping) -> Findings:
    """Look into a capture's frames.

    Parameters
    ----------
    folder : Path
        ``raw/<object>/<sensor>/<capture>``, whose images are right by their size and kind.
    sensor : mapping
        The sensor's specification.

    Returns
    -------
    Findings
    """
    first = Stream(folder, sensor)[0]
    if sensor["kind"] == "cloud":
        count, seen = (len(one.points_m) for one in (first, scene_cloud({"cloud": first}, sensor)))
        kind = f"points with{'' if first.normals is not None else 'out'} normals"
        return _timing(folder, f"{count} {kind}, {seen / count:.0%} of them in range")
    first = grey(first)
    found = _timing(folder, f"{first.shape[1]} x {first.shape[0]} px")
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
    if share < LEAST_CHANGED:
        expected = "object and probe, which the background must not hold"
        return _seldom(f"{folder}: frames", expected, f"{share:.2%} of the picture changed")
    if share > MOST_CHANGED:
        expected = "the background's scene (same place, same light)"
        found = f"{share:.0%} of the picture changed"
        return _seldom(f"{folder}: frames", expected, found, wrong=share > ALL_CHANGED)
    return Findings(found=(f"{share:.0%} of the picture new",))


def _seldom(place: str, expected: str, found: str, *, wrong: bool = False) -> Findings:
    """A line on what is wrong, or seldom right."""
    line = f"{place}: expected {expected}, found {found}"
    return Findings((line,)) if wrong else Findings(doubts=(line,))


def _timing(folder: Path, size: str) -> Findings:
    time = read_frames(folder)["time_s"].to_numpy(float)
    steps = np.diff(time)
    usual, longest = float(np.median(steps)), float(steps.max())
    rate = f"{len(time)} frames over {time[-1] - time[0]:.2f} s ({1 / usual:.1f} Hz)"
    found = Findings(found=(f"{rate}, {size}",))
    if longest > LONGEST_GAP * usual:
        expected, gap = f"frames about {usual:.3f} s apart", f"a gap of {longest:.2f} s"
        found += _seldom(f"{folder / FRAMES}: time_s", expected, gap)
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
        found = f"{typical:.3g} m in the middle (what does a count stand for?)"
        return _seldom(place, expected, found, wrong=True)
    result = Findings(found=(f"depth in {share:.0%}, {typical:.2f} m",))
    if share < LEAST_DEPTH_SHARE:
        expected = f"readings in {LEAST_DEPTH_SHARE:.0%} of the middle or more"
        result += _seldom(place, expected, f"{share:.0%}")
    return result
