"""Lines of sight past the probe, and what is seen along them."""

import numpy as np
import pytest
from palpate.estimate.direct.motion import CLEAR_WINDOWS, tip_clearance, views_of
from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import (
    ProbeInView,
    Samples,
    facing_samples,
    segment_distance,
)

UP = np.array([0.0, 0, 1])


def test_distance_of_a_line_of_sight():
    """Across, past an end, and against brute force."""
    first, last = np.array([0, 0, 0.0]), np.array([0, 0, 1.0])
    end, starts = np.array([2.0, 1, 0.5]), np.array([[-2.0, 1, 0.5], [2, 1, 3], [2, 1, 0.5001]])
    assert segment_distance(starts, end, first, last) == pytest.approx([1, 5**0.5, 5**0.5])
    rng = np.random.default_rng(1)
    starts, ends = rng.standard_normal((20, 3)), rng.standard_normal((3, 3))
    part = np.linspace(0, 1, 401)[:, None]
    other = ends[1] + part * (ends[2] - ends[1])
    for start, found in zip(starts, segment_distance(starts, *ends), strict=True):
        line = start + part * (ends[0] - start)
        least = np.linalg.norm(line[:, None] - other[None], axis=-1).min()
        assert found == pytest.approx(least, abs=4e-3)


def test_clearance_is_that_of_the_worst_view_and_of_a_part_of_the_probe():
    views = np.array([[0.0, -1, 0.0], [1.0, 0, 0]])
    probe = ProbeInView(views, np.zeros((2, 3)) + [0, 0, 0.01], np.tile([0, 0, -2.0], (2, 1)))
    places = np.array([[0.03, 0.2, 0.0], [-0.2, 0.02, 0.0], [0.3, -0.3, 0.0]])
    found = probe.clearance(places, 1, along_m=(0.0, 0.05))
    lines = [np.hypot(0.03 / np.hypot(0.03, 1.2), 0.01), np.hypot(0.02 / np.hypot(0.02, 1.2), 0.01)]
    assert found[:2] == pytest.approx(lines, rel=0.01)
    assert found[2] > 0.2
    assert probe.clearance(places, 1, along_m=(0.1, 0.2))[:2] == pytest.approx(0.11, rel=0.04)


def test_where_sensors_see_from():
    turned = np.array([[0.0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]])
    depth = {"baseline_m": 0.075, "color_from_depth": turned.tolist()}
    light = views_of({"kind": "structured_light", "depth": depth})
    assert light == pytest.approx(np.array([[0.1, 0.2, 0.3], [0.1, 0.275, 0.3]]))
    assert views_of({"kind": "depth", "depth": depth}) == pytest.approx(light[:1])
    stereo = views_of({"kind": "stereo", "stereo": {"baseline_m": 0.12}})
    assert stereo == pytest.approx(np.array([[0, 0, 0], [0.12, 0, 0]]))
    with pytest.raises(ValueError, match="kind: expected stereo, structured_light or depth, found"):
        views_of({"kind": "laser"})


def test_how_far_from_the_tip_a_line_of_sight_must_pass():
    stereo = {"kind": "stereo", "stereo": {"window_px": 11}, "color": {"fx_px": 800.0}}
    options = Observation(clear_m=0.02)
    # Windows of 11 pixels of 0.6 m / 800.
    beside_m = CLEAR_WINDOWS * 11 * 0.6 / 800
    assert tip_clearance(stereo, 0.6, options, radius_m=0.006) == pytest.approx(0.006 + beside_m)
    assert tip_clearance({"kind": "depth"}, 0.6, options, radius_m=0.006) == 0.02


def probe(frames):
    """Above the origin, its shaft straight up; in the last frame it was not found."""
    tip = np.tile([0.0, 0, 0.01], (frames, 1))
    tip[-1] = np.nan
    views = np.array([[0.0, 0, 0.5], [0.3, 0, 0.5]])
    return ProbeInView(views, tip, np.tile([0.0, 0, -1], (frames, 1)))


@pytest.mark.parametrize(("largest_view_deg", "kept"), [(45, [0]), (65, [0, 1, 2])])
def test_samples_that_are_seen_from_the_side(largest_view_deg, kept):
    """The second is 59 degrees from both views, the third 50 degrees from the second view."""
    samples = Samples(
        np.array([[0.0, 0, 0], [0.0, 0.2, 0], [-0.3, 0, 0]]), np.array([UP, [0, 0.6, 0.8], UP])
    )
    found = facing_samples(samples, probe(2), Observation(largest_view_deg=largest_view_deg))
    assert np.array_equal(found.cell_m, samples.cell_m[kept])
