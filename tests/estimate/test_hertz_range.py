"""Range of samples, depth below the undeformed surface, and presses that are refused."""

import numpy as np
import pytest
from palpate.estimate.hertz.indentation import (
    check_contact,
    force_onset,
    hertz_range,
    indentation_depth,
)
from palpate.surface.alignment import Alignment, AlignmentResidual
from palpate.surface.template import Template
from trimesh.creation import box

R = 0.00622


def test_range_is_from_onset_to_where_the_force_falls():
    force = np.array([0.01, 0.03, 0.02, 0.2, 0.6, 1.2, 1.1, 1.0])
    chosen = hertz_range(force, onset_force_n=0.1)
    assert chosen == (3, 5)


def test_a_hold_does_not_stretch_the_range():
    """Noise alone makes the highest sample of a hold that hardly relaxes."""
    rng = np.random.default_rng(4)
    true = np.r_[np.zeros(10), np.linspace(0.2, 2.0, 8), np.full(20, 2.0)]
    force = true + rng.normal(0, 0.02, true.size)
    force[30] = force.max() + 0.01
    chosen = hertz_range(force, onset_force_n=0.1)
    assert chosen[0] == 10
    assert 17 <= chosen[1] <= 19


def test_depth_is_that_of_the_lowest_point():
    block = box((0.6, 0.15, 0.0475))
    template = Template(np.asarray(block.vertices), np.asarray(block.faces))
    turn = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, [0.1, 0.2, 0.7]
    residual = AlignmentResidual(0.0, 0.0, 0.0, 0.0, 1)
    alignment = Alignment(pose, np.array([0, 0, 0.02375]), 1, residual)
    heights = np.array([0.015, 0.0, -0.003, -0.008])
    tips = np.column_stack([0 * heights, 0 * heights, 0.02375 + R + heights])
    depth = indentation_depth(template, alignment, tips @ turn.T + pose[:3, 3], radius_m=R)
    assert depth == pytest.approx(-heights, abs=1e-7)


def test_forces_that_are_refused():
    with pytest.raises(ValueError, match="force: expected above 0.1 N, found at most 0.05 N"):
        force_onset(np.array([0.0, 0.05]), onset_force_n=0.1)
    with pytest.raises(ValueError, match="expected samples before contact"):
        force_onset(np.array([0.5, 0.9]), onset_force_n=0.1)


@pytest.mark.parametrize(("depth_mm", "place"), [(7.0, "below"), (-9.0, "above")])
def test_a_press_that_begins_far_from_the_surface(depth_mm, place):
    depth = np.array([-0.02, depth_mm * 1e-3, depth_mm * 1e-3 + 0.001])
    with pytest.raises(ValueError, match=f"found it {abs(depth_mm)} mm {place} in frame 1"):
        check_contact(depth, 1)
    check_contact(depth - depth[1] + 0.001, 1)
