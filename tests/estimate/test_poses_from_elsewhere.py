"""The direct estimate with poses of a robot or a tracker: a shared base, two clocks, fast poses."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_indentation import (
    OPTIONS,
    RADIUS_M,
    SIX_ERRORS,
    START,
    indentation_of,
    made_up_table,
    random_cells,
)
from palpate.estimate.direct.budget import budget_of
from palpate.estimate.direct.fit import fit_direct
from palpate.estimate.direct.options import BASE_SOURCE, ProbeUncertainty
from palpate.estimate.direct.quantities import NAMES, quantities_of
from palpate.estimate.direct.result import nuisances

E, NU = 25e3, 0.3
# Of 6 draws the root mean square of deviations scatters by 0.3.
DRAWS, LEAST, MOST = 6, 0.3, 1.8
JUDGED = [NAMES.index("youngs_modulus_pa"), NAMES.index("poisson_ratio")]
TRUTH = np.array([np.log(E), NU])
# Of the tip by the base: along the indentation, and across it.
BASE_ROOT_M = np.diag([2e-4, 3e-3, 3e-3]) @ SIX_ERRORS
SHARED = {"shared_roots_m": {BASE_SOURCE: BASE_ROOT_M}, "place_std_m": 1e-5}


def found(captures):
    """The fit, log E and nu beside the truth, and their standard uncertainties."""
    best = fit_direct(captures, OPTIONS, START)
    stated = quantities_of(best, radius_m=RADIUS_M)
    std = budget_of(best, stated, radius_m=RADIUS_M).std
    return best, stated.values[JUDGED] - TRUTH, std[JUDGED]


def one_side():
    """Samples that the camera sees on one side of the contact, where its place matters."""
    cell = random_cells(np.random.default_rng(3))
    cell = cell[cell[:, 0] > 0.01]
    return cell, made_up_table(cell), made_up_table(cell)


def of_one_rig(rng, solid, seed):
    """Two captures with one error of the base."""
    along, *beside = BASE_ROOT_M @ rng.normal(size=6)
    each = [indentation_of(E, NU, s, solid=solid, beside_m=beside) for s in (seed, seed + 100)]
    return [replace(one, depth_m=one.depth_m - along) for one in each]


def test_a_base_that_all_captures_of_a_rig_share():
    """E and nu are off by as much as stated, E by no more."""
    rng, solid, deviations = np.random.default_rng(20260601), one_side(), []
    for seed in range(DRAWS):
        captures = of_one_rig(rng, solid, seed)
        _, off, std = found([replace(one, **SHARED) for one in captures])
        deviations.append(off / std)
    spread = np.sqrt(np.square(deviations).mean(axis=0))
    # The law of the force, of which E knows a prior alone, is not drawn.
    assert spread[1] > LEAST and (spread < MOST).all()


def test_the_clock_of_the_camera():
    """Of slow poses: E, nu and the clock are off by as much as stated; the force's is the camera's.

    But for the 10 ms that `indentation_of` states.
    """
    rng, deviations = np.random.default_rng(7), []
    for seed in range(DRAWS):
        clock_s, force_s = rng.normal(0, [0.04, 0.01])
        clocks = {"camera_clock_s": clock_s, "delay_s": clock_s - force_s}
        capture = indentation_of(E, NU, seed, **clocks)
        best, off, std = found([replace(capture, camera_clock_std_s=0.04)])
        own = nuisances(best, 0)
        clock = (own["camera_clock_s"] - clock_s) / own["camera_clock_std_s"]
        deviations.append([*off / std, clock])
        assert own["camera_clock_std_s"] < 0.04 and -1 < own["clocks_correlation"] < 1
    spread = np.sqrt(np.square(deviations).mean(axis=0))
    assert (spread > LEAST).all() and (spread < MOST).all()


def test_fast_poses_agree_with_the_frames_and_are_sharper():
    """Of six times as many depths by up to the root of six."""
    for seed in (1, 2):
        fast = indentation_of(E, NU, seed, poses_per_frame=6)
        at, rows, _ = fast.frames_pictured
        alone = replace(
            fast,
            time_s=fast.time_s[at],
            force_n=fast.force_n[at],
            tip_depth_m=fast.tip_depth_m[at],
            pictured=...,
            frames=np.searchsorted(at, fast.frames[rows]),
            depth_m=fast.depth_m[rows],
            depth_root_m=fast.depth_root_m[np.ix_(rows, rows)],
            **{
                name: getattr(fast, name)[rows]
                for name in ("moved_m", "noise_std_m", "moved_std_m")
            },
        )
        assert np.isfinite(alone.moved_m).all()
        (_, off, std), (_, off_alone, std_alone) = found([fast]), found([alone])
        assert (np.abs(off - off_alone) < 2 * std_alone).all()
        assert (std < std_alone).all() and (std > 0.3 * std_alone).all()


@pytest.mark.parametrize("stated", [True, False])
def test_the_base_moves_a_place_by_its_turn_and_its_shift(stated):
    """Turned about the base frame's origin and shifted, in the camera's axes; both correlate."""
    camera_from_base = np.eye(4)
    camera_from_base[:3, 3] = [0.3, -0.2, 1.1]
    base, covariance = {"camera_from_base": camera_from_base.tolist()}, 1e-6 * np.eye(6)
    if stated:
        covariance += 4e-6 * np.cov(np.random.default_rng(2).normal(size=(6, 20)))
        base["covariance"] = covariance.tolist()
    root = ProbeUncertainty.of({}, base).base_root_m(np.array([0.5, 0.1, 0.8]))
    turned = np.transpose([np.cross(axis, [0.2, 0.3, -0.3]) for axis in np.eye(3)])
    moves = np.hstack([turned, np.eye(3)])
    assert root @ root.T == pytest.approx(moves @ covariance @ moves.T, abs=1e-12)
