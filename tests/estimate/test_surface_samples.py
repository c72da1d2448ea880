"""Samples of a surface, what is seen on them, and how far their heights scatter."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from palpate.estimate.direct.blocks import bounded_solution, sharing_of
from palpate.estimate.direct.correspondences import (
    ProbeInView,
    clearance,
    facing_samples,
    hidden_samples,
)
from palpate.estimate.direct.indentation import OWN
from palpate.estimate.direct.motion import noise_variance
from palpate.estimate.direct.options import Fit, Observation
from palpate.estimate.direct.placement import object_from_table
from palpate.estimate.direct.quantities import NAMES, quantities_of
from palpate.estimate.direct.sample_heights import _medians, cell_heights
from palpate.estimate.direct.samples import ClosestAtRest, Samples, samples_of
from palpate.solid.smooth_surface import SmoothSurface
from scipy.optimize import minimize

UP = np.array([0.0, 0, 1])


def feet(places, distances=0.0, normals=UP):
    places = np.array(places, dtype=float)
    count = len(places)
    normal = np.array(np.broadcast_to(normals, (count, 3)))
    return ClosestAtRest(places, normal, np.array(np.broadcast_to(distances, count)))


def test_seeds_begin_at_the_centre_and_keep_their_distance():
    """Feet at every millimetre along x, a centre at 10.2 mm, seeds three millimetres apart."""
    line = [[k * 1e-3, 0, 0] for k in range(21)]
    found = samples_of([feet(line)], np.array([0.0102, 0, 0]), spacing_m=0.003)
    # Seeds at 10, then 14 and 6, then 18 and 2: each foot is of the nearest, 4 mm between.
    assert np.sort(found.cell_m[:, 0]) == pytest.approx(
        [0.0015, 0.0055, 0.0095, 0.0135, 0.0185], abs=1.1e-3
    )
    assert found.cell_m[0, 0] == pytest.approx(0.01, abs=1.1e-3)
    assert found.normal == pytest.approx(np.tile(UP, (5, 1)))


def test_samples_lie_at_the_means_of_all_frames_feet():
    first = feet([[0, 0, 0], [0.01, 0, 0]])
    side = np.array([0.5, 0, np.sqrt(0.75)])
    later = feet([[0.001, 0.002, 0], [0.009, 0, 0.001], [0.5, 0, 0]], normals=[UP, side, UP])
    other = feet([[0.0005, 0, 0]], normals=-UP)
    found = samples_of([first, later, other], np.zeros(3), spacing_m=0.004)
    assert found.cell_m == pytest.approx(np.array([[0.0005, 0.001, 0], [0.0095, 0, 0.0005]]))
    # A normal turned by half a radian is still alike; one turned round belongs to another side.
    mean = (UP + side) / np.linalg.norm(UP + side)
    assert found.normal == pytest.approx(np.stack([UP, mean]))


def test_feet_belong_to_the_nearest_sample_that_faces_alike():
    samples = Samples(np.array([[0.0, 0, 0], [0.01, 0, 0]]), np.stack([UP, UP]))
    tilted = np.array([0.5, 0, np.sqrt(0.75)])
    close = feet([[0.004, 0, 0], [0.006, 0, 0], [0.014, 0, 0], [0.0161, 0, 0]])
    assert samples.numbers(close, reach_m=0.006).tolist() == [0, 1, 1, -1]
    assert samples.numbers(feet([[0.0, 0, 0]], normals=tilted), reach_m=0.006).tolist() == [0]
    beyond = np.array([0.62, 0, np.sqrt(1 - 0.62**2)])
    assert samples.numbers(feet([[0.0, 0, 0]], normals=beyond), reach_m=0.006).tolist() == [-1]


def test_medians_of_groups():
    numbers = np.array([2, 0, 2, 2, 0, 2])
    values = np.array([5.0, 1.0, 2.0, 9.0, 4.0, 3.0])
    assert _medians(numbers, values, 4) == pytest.approx([2.5, np.nan, 4.0, np.nan], nan_ok=True)
    assert np.isnan(_medians(np.zeros(0, int), np.zeros(0), 2)).all()


def test_heights_are_clipped_means():
    rng = np.random.default_rng(2)
    samples = Samples(np.array([[0.0, 0, 0], [0.02, 0, 0], [0.04, 0, 0]]), np.tile(UP, (3, 1)))
    frames = []
    for height in (0.001, -0.002):
        places = np.repeat(samples.cell_m[:2], 200, axis=0)
        far = height + rng.normal(0, 1e-4, 400)
        far[:20] += 0.004
        frames.append(feet([*places, [0.04, 0, 0]], [*far, 0.0]))
    options = Observation(spacing_m=0.004)
    height, points = cell_heights(samples, frames, options)
    assert height[:, :2] == pytest.approx(np.array([[0.001] * 2, [-0.002] * 2]), abs=3e-5)
    # Twenty outliers of the first are left out; one point alone is not seen.
    assert (points[:, 0] == 180).all() and (points[:, 1] == 200).all()
    assert (points[:, 2] == 1).all() and np.isnan(height[:, 2]).all()


def test_a_samples_few_frames_are_taken_with_what_is_usual():
    """Six frames' worth of the median sample's variance, by its chi square's median."""
    noise = np.array([[1.0, 2, np.nan], [-1, -2, 1], [1, 2, -1], [-1, -2, np.nan]])
    variance, own = noise_variance(noise)
    assert own.tolist() == [4, 4, 2]
    squares = np.array([4.0, 16, 2])
    # Medians of chi squares of 3, 3 and 1 degrees of freedom.
    usual = np.median(squares / [2.36597, 2.36597, 0.45494])
    assert variance == pytest.approx((6 * usual + squares) / (6 + np.array([3, 3, 1])), rel=1e-4)


def test_how_far_from_the_tip_a_line_of_sight_must_pass():
    stereo = {"kind": "stereo", "stereo": {"window_px": 11}, "color": {"fx_px": 800.0}}
    given = {"radius_m": 0.006, "windows": 1.5, "otherwise_m": 0.02}
    # 1.5 windows of 11 pixels of 0.6 m / 800.
    assert clearance(stereo, 0.6, **given) == pytest.approx(0.006 + 16.5 * 0.6 / 800)
    assert clearance({"kind": "depth"}, 0.6, **given) == 0.02


def probe(frames, eyes=((0.0, 0, 0.5), (0.3, 0, 0.5))):
    """Above the origin, its shaft straight up; in the last frame it was not found."""
    tip = np.tile([0.0, 0, 0.01], (frames, 1))
    tip[-1] = np.nan
    return ProbeInView(np.array(eyes), tip, np.tile([0.0, 0, -1], (frames, 1)))


def test_samples_that_an_eye_sees_from_the_side():
    places = np.array([[0.0, 0, 0], [0.0, 0.2, 0], [-0.3, 0, 0]])
    normals = np.array([UP, [0, 0.6, 0.8], UP])
    found = facing_samples(Samples(places, normals), probe(2), Observation(largest_view_deg=45))
    # The third is 50 degrees from the second eye, the second 59 degrees from both.
    assert found.cell_m.tolist() == [[0, 0, 0]]
    every = facing_samples(Samples(places, normals), probe(2), Observation(largest_view_deg=65))
    assert len(every.cell_m) == 3


def test_samples_that_the_probe_hides():
    options = Observation(clear_m=0.02, shaft_clear_m=0.05)
    samples = Samples(np.array([[0.01, 0, 0], [0.2, 0.2, 0], [0.0, 0.04, 0]]), np.tile(UP, (3, 1)))
    points = np.array([[10, 10, 10], [10, 10, 10], [10, 4, 10], [10, 10, 10]])
    found = hidden_samples(samples, points, probe(4), np.array([0, 1]), options)
    # Under the probe; away from it, but for a frame with too few; beside the tip, under the shaft.
    assert found[:3].tolist() == [[True, False, True], [True, False, True], [True, True, True]]
    assert found[3].all()
    near = Observation(clear_m=0.02, shaft_clear_m=0.01)
    assert not hidden_samples(samples, points, probe(4), np.array([0, 1]), near)[0, 2]


def test_a_tables_place_turns_with_the_normal():
    ball = trimesh.creation.icosphere(4, radius=0.05)
    surface = SmoothSurface(np.array(ball.vertices), np.array(ball.faces))
    table = SimpleNamespace(
        point_m=np.array([0, 0, 0.05]),
        direction=-UP,
        radius_m=0.006,
        surface_rest_m=np.array(ball.vertices),
    )
    way = np.array([np.sin(0.2), 0, np.cos(0.2)])
    found = object_from_table(table, surface, 0.056 * way)
    assert found[:3, :3] @ UP == pytest.approx(way, abs=1e-3)
    assert found @ [0, 0, 0.056, 1] == pytest.approx([*(0.056 * way), 1], abs=1e-5)
    same = object_from_table(table, surface, np.array([0, 0, 0.056]))
    assert same == pytest.approx(np.eye(4), abs=1e-4)
    far = 0.056 * np.array([np.sin(0.4), 0, np.cos(0.4)])
    with pytest.raises(ValueError, match=r"found 21.8 mm away"):
        object_from_table(table, surface, far)


def test_facets_do_not_turn_a_table():
    """On a ball of facets that meet at 13 degrees, from many places to others 3 mm beside."""
    ball, fine = (trimesh.creation.icosphere(k, radius=0.05) for k in (2, 4))
    surface = SmoothSurface(np.array(ball.vertices), np.array(ball.faces))
    rest = surface.nearest(np.array(fine.vertices))
    for seed in range(20):
        rng = np.random.default_rng(seed)
        towards = rng.normal(size=3)
        towards /= np.linalg.norm(towards)
        table = SimpleNamespace(
            point_m=0.05 * towards, direction=-towards, radius_m=0.006, surface_rest_m=rest
        )
        beside = np.cross(towards, rng.normal(size=3))
        there = towards + 0.06 * beside / np.linalg.norm(beside)
        there /= np.linalg.norm(there)
        found = object_from_table(table, surface, 0.056 * there)
        # A degree is 0.017.
        assert found[:3, :3] @ towards == pytest.approx(there, abs=0.004)


def test_least_of_a_quadratic_within_bounds():
    rng = np.random.default_rng(5)
    root = rng.normal(size=(4, 4)) * [1, 10, 0.1, 1]
    matrix, right = root.T @ root, rng.normal(size=4)
    low, high = np.array([-np.inf, -0.01, -1.0, -0.2]), np.array([np.inf, 0.02, 0.5, np.inf])
    found = bounded_solution(matrix, right, low, high)
    best = minimize(
        lambda x: x @ matrix @ x / 2 - right @ x,
        np.zeros(4),
        jac=lambda x: matrix @ x - right,
        bounds=list(zip(low, high, strict=True)),
        method="L-BFGS-B",
        options={"ftol": 1e-16, "gtol": 1e-12, "maxiter": 5000},
    )
    assert found == pytest.approx(best.x, rel=1e-3, abs=1e-5)
    free = bounded_solution(matrix, right, np.full(4, -np.inf), np.full(4, np.inf))
    assert free == pytest.approx(np.linalg.solve(matrix, right), rel=1e-6)


@pytest.mark.parametrize(
    ("patch", "frame", "both"),
    [(0, 0, 0), (0.2, 0, 0), (0, 0.2, 0), (0.2, 0.2, 0), (0, 0, 0.7), (0.2, 0.2, 0.7)],
)
def test_motions_of_a_patch_or_a_frame_that_err_together(patch, frame, both):
    """A patch has two motions in each frame: 1 + their number times the variance they share."""
    rng, frames, patches = np.random.default_rng(3), 60, 120
    shape = (frames, 2 * patches)
    cluster = np.repeat(np.arange(patches), 2)
    axis = np.where(cluster < 60, 0, 2)
    common = rng.normal(0, patch, patches)[cluster] + rng.normal(0, frame, (frames, 1))
    common = common + rng.normal(0, both, (frames, patches))[:, cluster]
    gaps = rng.normal(0, np.sqrt(1 - both**2), shape) + common * (axis == 0)
    press = SimpleNamespace(seen=np.ones(shape, dtype=bool), cluster=cluster, axis=axis)
    press.kind = np.broadcast_to(np.minimum(axis, 1), shape).ravel()
    slope = np.column_stack([np.ones(gaps.size), np.zeros(gaps.size), rng.normal(size=gaps.size)])
    line = SimpleNamespace(residuals=SimpleNamespace(motion=gaps.ravel()), motion_slope=slope)
    along, across = sharing_of(press, line, (1.0, 1.0))
    assert along == pytest.approx(1 + both**2 + 120 * (patch**2 + frame**2), rel=0.25)
    assert across < 1.5


def test_moduli_of_an_estimate():
    """E 20 kPa, nu 0.3, a law of 0.4 of the way to one that stiffens by 0.2 d / 1 mm + 0.5 nu."""
    table = SimpleNamespace(
        stiffening_at=lambda depth, nu: (0.2 * depth / 1e-3 + 0.5 * nu, np.full(len(depth), 0.5))
    )
    vector = np.r_[np.log(20e3), 0.3, 0.4, 0.1, 0.0, 0.0, 0.1, 0.2, np.zeros(OWN)]
    best = SimpleNamespace(
        vector=vector,
        indentations=[SimpleNamespace(depth_m=np.array([0.001, 0.0029]), table=table)],
        parameters=[SimpleNamespace(offset_m=1e-4)],
    )
    options = Fit(relaxation_times_s=(0.5, 2.0))
    found = quantities_of(best, options, radius_m=0.006)
    values = dict(zip(NAMES, found.values, strict=True))
    star = np.log(20e3 / 0.91)
    assert values["reduced_modulus_pa"] == pytest.approx(star)
    assert values["youngs_modulus_pa"] == pytest.approx(np.log(20e3))
    assert found.depth_m == pytest.approx(0.7 * 0.003)
    assert found.depth_radii == pytest.approx(found.depth_m / 0.006)
    assert found.strain == pytest.approx(0.2 * np.sqrt(found.depth_radii))
    lost = 0.1 * (1 - np.exp(-2)) + 0.2 * (1 - np.exp(-0.5))
    assert values["youngs_modulus_1s_pa"] == pytest.approx(np.log(20e3 * (1 - lost)))
    # At 2.1 mm it stiffens by 0.42 and, by nu, 0.15.
    effective = star + 0.4 * 0.57 + np.log(1 - lost)
    assert values["effective_reduced_modulus_pa"] == pytest.approx(effective)
    slopes = dict(zip(NAMES, found.slopes, strict=True))
    assert slopes["reduced_modulus_pa"][:3] == pytest.approx([1, 0.6 / 0.91, 0])
    effective = slopes["effective_reduced_modulus_pa"]
    assert effective[:3] == pytest.approx([1, 0.6 / 0.91 + 0.4 * 0.5, 0.57])
    later = slopes["youngs_modulus_1s_pa"]
    expected = [-(1 - np.exp(-2)) / (1 - lost), -(1 - np.exp(-0.5)) / (1 - lost)]
    assert later[[0, 1, 6, 7]] == pytest.approx([1, 0, *expected])
    assert effective[[6, 7]] == pytest.approx(expected)
    asked = quantities_of(best, options.changed(effective_depth_m=0.001), radius_m=0.006)
    assert asked.depth_m == 0.001
