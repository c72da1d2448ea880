"""Surface displacement from clouds: what cancels, what is left, what the probe hides."""

from dataclasses import replace

import numpy as np
import pytest
from palpate.estimate.direct.deviations import correlation_length
from palpate.estimate.direct.motion import CLEAR_WINDOWS, observed_motion, rest_frames
from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import ProbeInView, RestSurface
from palpate.surface.alignment import Alignment
from palpate.surface.template import Template
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from synthetic_capture import camera_from_object
from trimesh.creation import box, icosphere

TOP_M = 0.02
REST, LOADED = 6, 4
FRAMES = REST + LOADED
# The camera looks down on the block from the front, half a metre away.
POSE = camera_from_object(np.array([0.0, -0.35, 0.37]), np.array([0, 0, TOP_M]))
STEP_M, RADIUS_M = 0.0019, 0.006
# Matching windows so large that samples beside the tip must be 12 mm clear of it.
WINDOW = {"baseline_m": 0.1, "window_px": 0.012 / CLEAR_WINDOWS / np.hypot(0.35, 0.35)}
HEAD = {"kind": "stereo", "stereo": WINDOW, "color": {"fx_px": 1.0}}


def template():
    block = box((0.3, 0.16, 2 * TOP_M))
    return Template(np.asarray(block.vertices), np.asarray(block.faces))


def alignment(pose=POSE):
    return Alignment(pose, np.array([0, 0, TOP_M]), REST, 0.0)


def dent(places_m):
    """Displacement of the surface once loaded [m]: a few tenths of a millimetre at 20 mm."""
    return -8e-6 / (np.linalg.norm(places_m, axis=1) + 0.002)


def clouds(*, std_m=0.0, bias_m=0.0, seed=3):
    """Frames at rest and loaded, camera frame, of a jittered grid on the top."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(-0.09, 0.09, STEP_M), np.arange(-0.07, 0.07, STEP_M))
    grid, frames = np.column_stack([x.ravel(), y.ravel()]), []
    for k in range(FRAMES):
        flat = grid + rng.uniform(-0.3, 0.3, grid.shape) * STEP_M
        wave = bias_m * np.sin(flat[:, 0] / 0.01)
        height = TOP_M + wave + (dent(flat) if k >= REST else 0)
        points = np.column_stack([flat, height + std_m * rng.standard_normal(len(flat))])
        frames.append(in_camera(points))
    return frames


def in_camera(points):
    normals = np.broadcast_to(POSE[:3, 2], points.shape)
    return points @ POSE[:3, :3].T + POSE[:3, 3], normals


def probe():
    """A probe that stands upright: clear at first, then in the dent."""
    tips = np.tile([0.0, 0.0, TOP_M + RADIUS_M], (FRAMES, 1))
    tips[: REST - 2, 2] += 0.02
    return in_camera(tips)[0], np.tile(-POSE[:3, 2], (FRAMES, 1))


def motion(frames, aligned=None, rest=tuple(range(REST)), seen=None, **options):
    chosen, known = Observation(**{"reach_m": 0.06} | options), (template(), aligned or alignment())
    given = frames, seen or probe(), np.array(rest, dtype=int), HEAD, chosen
    return observed_motion(*known, *given, radius_m=RADIUS_M)


def test_displacement_is_that_of_the_surface_and_fixed_errors_cancel():
    """Samples stand at the mean of their points; errors of template, calibration and alignment."""
    found = motion(clouds())
    expected = dent(found.cell_m[:, :2])
    assert np.isfinite(found.moved_m[REST:]).sum() > 1000
    assert found.normal == pytest.approx(np.tile([0, 0, 1], (len(found.normal), 1)), abs=1e-6)
    assert np.nanmax(np.abs(found.moved_m[:REST])) < 1e-7
    error = found.moved_m[REST:] - expected
    assert abs(np.nanmean(error)) < 1e-6
    assert np.nanstd(error) < 0.03 * np.ptp(expected)
    shifted = POSE.copy()
    shifted[:3, :3] = Rotation.from_rotvec([0.002, -0.001, 0]).as_matrix() @ shifted[:3, :3]
    shifted[:3, 3] += [0, 0, 0.0004]
    exact = motion(clouds(bias_m=3e-4))
    off = motion(clouds(bias_m=3e-4), alignment(shifted))
    assert np.abs(off.cell_m.mean(axis=0) - exact.cell_m.mean(axis=0)).max() > 1e-5
    for found in (exact, off):
        error = found.moved_m[REST:] - dent(found.cell_m[:, :2])
        assert abs(np.nanmean(error)) < 4e-6


def test_stated_deviations_hold_and_outliers_are_left_out():
    found = motion(clouds(std_m=3e-4))
    error = found.moved_m[REST:] - dent(found.cell_m[:, :2])
    stated = np.hypot(found.std_m, found.rest_std_m)[REST:]
    assert np.sqrt(np.nanmean((error / stated) ** 2)) == pytest.approx(1, abs=0.12)
    frames = clouds(std_m=1e-4)
    rng = np.random.default_rng(5)
    with_outliers = [
        (points + (rng.random(len(points)) < 0.03)[:, None] * 0.004 * normals, normals)
        for points, normals in frames
    ]
    error = motion(with_outliers).moved_m - motion(frames).moved_m
    assert abs(np.nanmean(error[REST:])) < 1.5e-5


def test_what_the_probe_hides_is_not_seen():
    """Behind it or beside it, and nothing where it was not found."""
    found = motion(clouds())
    x, y = found.cell_m[:, 0], found.cell_m[:, 1]
    beside, behind = np.hypot(x, y) < 0.012, (np.abs(x) < 0.008) & (y > 0) & (y < 0.05)
    assert np.isnan(found.moved_m[REST:, beside | behind]).all()
    assert np.isfinite(found.moved_m[REST:, (y < -0.025) & (y > -0.05)]).mean() > 0.9
    # The second camera stands on the right: what it does not see is not there either.
    reach = [np.isnan(found.moved_m[-1, (np.sign(x) == side) & (y > 0)]).mean() for side in (-1, 1)]
    assert reach[0] > 1.3 * reach[1]
    lost = probe()
    lost[0][-1] = np.nan
    found = motion(clouds(), seen=lost)
    assert np.isnan(found.moved_m[-1]).all()
    assert np.isfinite(found.moved_m[-2]).mean() > 0.3


@pytest.mark.parametrize("part", [0.0, 0.3])
def test_a_cell_that_loses_most_of_its_points_is_not_seen(part):
    frames, rng = clouds(), np.random.default_rng(4)
    points, normals = frames[-1]
    flat = (points - POSE[:3, 3]) @ POSE[:3, :3]
    kept = (np.abs(flat[:, 0] - 0.04) > 0.012) | (rng.random(len(flat)) < part)
    frames[-1] = points[kept], normals[kept]
    found = motion(frames, spacing_m=0.006)
    lost = np.abs(found.cell_m[:, 0] - 0.04) < 0.008
    assert np.isnan(found.moved_m[-1, lost]).mean() > 0.9
    assert np.isfinite(found.moved_m[-2, lost]).mean() > 0.7


def test_rest_ends_with_the_touch():
    depth = np.array([-0.015, -0.01, -0.003, -0.0003, 0.0002, 0.001, -0.01])
    force = np.array([0.0, 0.01, 0.0, 0.02, 0.03, 0.5, 0.0])

    def at_rest(depth_m, force_n):
        tips = np.outer(TOP_M + 0.006 - depth_m, [0, 0, 1])
        given = template(), alignment(), in_camera(tips)[0], np.outer(force_n, [0, 0, 1])
        return rest_frames(*given, radius_m=0.006, onset_force_n=0.1).tolist()

    assert at_rest(depth, force) == [0, 1, 2]
    assert at_rest(depth, 0 * force) == [0, 1, 2, 6]
    with pytest.raises(ValueError, match="frames: expected frames before the force's onset"):
        at_rest(depth + 0.02, force)


AWAY = replace(alignment(), contact_point_m=np.array([0.145, 0, TOP_M]))


@pytest.mark.parametrize(
    ("first", "given", "line"),
    [
        (0, {"rest": []}, "frames: expected some at rest"),
        (1, {}, "one place of the probe for each of 9, found 6, 10"),
        (0, {"aligned": AWAY}, "within 0.04 m of the contact in view, found none of it"),
        (0, {"largest_view_deg": 5}, "some surface seen at less than 5 degrees to its normal"),
        (0, {"shaft_clear_m": 0.5}, "clouds: expected samples seen in 3 frames at rest"),
    ],
)
def test_bad_input(first, given, line):
    with pytest.raises(ValueError, match=line):
        motion(clouds()[first:], **given)


def rest_of(mesh, points, normals):
    surface = RestSurface(Template(np.array(mesh.vertices), np.array(mesh.faces)))
    return surface.at_rest(points, normals, Observation(largest_distance_m=0.01))


def test_points_have_the_normals_of_balls_and_of_a_boxs_sides():
    """A ball's facets are turned by up to four degrees."""
    out = np.random.default_rng(2).normal(size=(500, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    found = rest_of(icosphere(3, radius=0.06), 0.061 * out, out)
    assert np.linalg.norm(found.normal, axis=1) == pytest.approx(np.ones(500))
    angle = np.degrees(np.arccos(np.clip((found.normal * out).sum(axis=1), -1, 1)))
    assert angle.max() < 0.5
    block = box((0.1, 0.1, 0.04)).subdivide()
    above = np.column_stack([np.linspace(-0.049, 0.049, 30), np.full(30, 0.02), np.full(30, 0.022)])
    up = np.tile([0.0, 0, 1], (30, 1))
    found = rest_of(block, above, up)
    assert found.normal == pytest.approx(up)
    assert found.distance_m == pytest.approx(np.full(30, 0.002), abs=1e-6)


@pytest.mark.parametrize("length_m", [0.005, 0.010])
def test_length_of_the_noises_correlation(length_m):
    x, y = (one.ravel() for one in np.mgrid[-0.04:0.04:0.0035, -0.04:0.04:0.0035])
    places = np.column_stack([x, y, 0 * x])
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    values, vectors = np.linalg.eigh(np.exp(-((apart / length_m) ** 2)))
    root = vectors * np.sqrt(np.maximum(values, 0))
    noise = (root @ np.random.default_rng(2).standard_normal((len(places), 60))).T
    noise[3, :40] = np.nan
    assert correlation_length(places, noise) == pytest.approx(length_m, rel=0.06)
    assert correlation_length(places[:1], noise[:, :1]) == 0


@pytest.mark.parametrize("along_m", [(0.0, 0.05), (0.1, 0.2)])
def test_clearance_is_that_of_the_worst_view_and_of_a_part_of_the_probe(along_m):
    """Against brute force: lines of sight that pass it, end before it, or begin beyond it."""
    rng = np.random.default_rng(1)
    views, places = 0.5 * rng.standard_normal((2, 3)), 0.1 * rng.standard_normal((40, 3))
    axis = np.array([0.0, 0.6, -0.8])
    seen = ProbeInView(views, np.zeros((2, 3)) + [0, 0, 0.01], np.tile(axis, (2, 1)))
    part = np.linspace(0, 1, 801)[:, None]
    shaft = seen.tip_m[1] - (along_m[0] + part * np.ptp(along_m)) * axis
    for place, found in zip(places, seen.clearance(places, 1, along_m=along_m), strict=True):
        lines = np.concatenate([place + part * (view - place) for view in views])
        assert found == pytest.approx(cKDTree(shaft).query(lines)[0].min(), abs=1.5e-3)
