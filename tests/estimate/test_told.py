"""Numbers of direct.json, each worked out apart; a press's foot; the linear method's first step."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from floor import floor
from made_up_press import OPTIONS, START, press_of
from palpate.estimate.direct.blocks import Scales
from palpate.estimate.direct.doubts import doubts_of
from palpate.estimate.direct.result import _nuisances, _summed, described_law
from palpate.estimate.direct.support_motion import rocking_axes


def test_what_a_capture_has_for_itself():
    p = replace(
        START,
        offset_m=1e-4,
        clock_s=0.01,
        shift_m=np.array([2e-5, 0, 0]),
        place_m=np.array([1e-3, 2e-3]),
        picture_m=np.array([5e-4, 0]),
    )
    known = SimpleNamespace(zero_std_m=3e-3)
    told = _nuisances(known, replace(p, support_motion=np.array([3e-5, 1e-4, -2e-4])))
    assert told == {
        "offset_m": 1e-4,
        "offset_std_m": 3e-3,
        "clock_s": 0.01,
        "shift_m": [2e-5, 0, 0],
        "place_m": [1e-3, 2e-3],
        "picture_m": [5e-4, 0],
        "sunk_m": 3e-5,
        "rocked_rad": [1e-4, -2e-4],
    }


def test_residuals_against_what_was_stated():
    press = press_of(25e3, 0.3, 1)
    moved = press.moved_m.copy()
    moved[:, :7] = np.nan
    moved[0] = np.nan
    std = np.full(moved.shape, 4e-5)
    std[1] = 1.0
    one = replace(press, moved_m=moved, moved_std_m=std, depth_root_m=2 * press.depth_root_m)
    told = _summed(one, Scales((1.5, 1.0), (3.0, 1.0)))
    assert told["cells"] == moved.shape[1] - 7
    assert told["patches"] == len(np.unique(press.cluster[7:]))
    assert told["motion_std_m"] == pytest.approx(6e-5)
    assert (told["motion_scale"], told["motion_sharing"]) == (1.5, 3.0)
    assert told["depth_std_m"] == pytest.approx(1.6e-4) and told["depth_scale"] == pytest.approx(2)
    assert told["largest_depth_m"] == press.depth_m.max()


def test_places_among_the_laws():
    found = SimpleNamespace(
        std=np.array([0.1, 0.2, 0.3, 0.4, 0.5]),
        quantities=SimpleNamespace(depth_m=0.002, depth_radii=0.33, strain=0.11),
        solution=SimpleNamespace(
            parameters=[SimpleNamespace(force_law=0.6, motion_law=-0.7)],
        ),
    )
    assert described_law(found) == {
        "law": {"force": {"value": 0.6, "std": 0.3}, "motion": {"value": -0.7, "std": 0.4}},
        "effective": {"depth_m": 0.002, "after_s": 1.0, "depth_over_radius": 0.33, "strain": 0.11},
    }


@pytest.mark.parametrize(("nu", "said"), [(0.355, False), (0.345, False), (0.375, True)])
def test_captures_that_pull_away_from_a_given_ratio(nu, said):
    options = OPTIONS.changed(poisson_ratio=0.35, poisson_ratio_std=0.01)
    press = press_of(25e3, 0.3, 1)
    p = replace(START, youngs_modulus_pa=25e3, poisson_ratio=nu, offset_m=0.0)
    best = SimpleNamespace(converged=True, parameters=[p], indentations=[press])
    lines = [
        line for line in doubts_of(best, options, np.ones(4)) if "the captures pull nu" in line
    ]
    assert lines == (["the captures pull nu to 0.375, 2.5 deviations from the one given"] * said)


def test_a_foot_is_broad_beside_the_height_of_the_contact():
    """A box of 40 x 40 mm: as a disc of 22.6 mm, half of 45 mm."""
    box = trimesh.creation.box((0.04, 0.04, 0.1))
    box.apply_translation([0, 0, 0.05])
    surface = np.array(box.vertices), np.array(box.faces)
    loose = floor(1e-3, contact="resting")
    for height, broad in ((0.045, True), (0.0455, False)):
        assert loose.is_broad(*surface, np.array([0, 0, height])) == broad
    assert not floor(1e-3).is_broad(*surface, np.array([0, 0, 0.02]))


@pytest.mark.parametrize("up", [[0, 0, 1.0], [1.0, 0, 0], [-0.95, 0.3, 0.1]])
def test_axes_across_a_press(up):
    up = np.array(up) / np.linalg.norm(up)
    first, second = rocking_axes(up)
    turned = np.stack([first, second, up])
    assert turned @ turned.T == pytest.approx(np.eye(3))
    assert np.cross(up, first) == pytest.approx(second)
