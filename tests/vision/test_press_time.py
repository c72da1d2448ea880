"""Whether a force is of the press that was filmed: what it makes of depths, and what is refused."""

import numpy as np
import pytest
from palpate.vision.press_time import (
    MOST_RELAXED,
    RELAXATION_S,
    _Followed,
    _Frames,
    check_time,
    elastic_force,
    force_ways,
)

NOISE_N, DEPTH_STD_M = 0.03, 1.5e-4
FORCE_S, FRAMES_S = np.arange(-0.3, 3.61, 0.01), np.arange(0, 3.3, 1 / 6)


def pressed(time_s, *, late_s=0.0):
    """A hand's way in millimetres: down to 1 mm above the object at 1 s, 3.5 mm in 1.8 s, held."""
    time_s = time_s - late_s
    return 15 * np.clip((time_s - 0.5) / 0.5, 0, 1) - 16 + 3.5 * np.clip((time_s - 1) / 1.8, 0, 1)


def recorded(seed, *, late_s=0.0, shake_mm=0.0, frames_s=FRAMES_S):
    """Force record of 2 N and depths at frames [m], of a hand that shakes at 1.2 Hz."""
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0, 2 * np.pi)

    def way(time_s):
        return pressed(time_s) + shake_mm * np.sin(2.4 * np.pi * time_s + phase)

    force = 0.5 * np.maximum(way(FORCE_S - late_s), 0) ** 1.5 + rng.normal(0, NOISE_N, FORCE_S.size)
    depth = 1e-3 * way(frames_s) + rng.normal(0, DEPTH_STD_M, frames_s.size)
    return FORCE_S, force, frames_s, depth, np.full(frames_s.size, DEPTH_STD_M)


def check(seed, **how):
    check_time(*recorded(seed, **how), noise_n=NOISE_N, prior_std_s=0.05)


def test_presses_at_their_time_are_taken():
    """A hundred of them, of chance one in a thousand; shaking hands too, whose shaking tells."""
    for seed in range(50):
        check(seed, late_s=0.05)
        check(seed, late_s=-0.05, shake_mm=0.3)


def test_a_straight_way_tells_little_of_its_time_and_a_shaking_one_more():
    def refused(shake_mm):
        count = 0
        for seed in range(20):
            try:
                check(seed, late_s=0.4, shake_mm=shake_mm)
            except ValueError as error:
                assert "expected the clock of frames.csv within 0.125 s" in str(error)
                count += 1
        return count

    assert refused(0.0) < 5
    assert refused(0.8) > 15


def test_a_press_a_second_away_is_found_there():
    with pytest.raises(ValueError, match=r"found the press about -0\.[6-9]\d s away"):
        check(1, late_s=-0.8, shake_mm=0.8)


def test_a_quick_tap_is_told_where_its_right_time_is_likely():
    """Four frames in contact; at offsets at which fewer are, nothing is told for it or against."""
    time = np.arange(0, 3, 1 / 6)

    def tap(at):
        return 4 - 12 * np.abs(at - 1.5)

    for seed in range(4):
        rng = np.random.default_rng(seed)
        depth = 1e-3 * tap(time) + rng.normal(0, DEPTH_STD_M, time.size)
        std = np.full(time.size, DEPTH_STD_M)
        for late, right in ((0.0, True), (0.9, False)):
            force = 0.5 * np.maximum(tap(FORCE_S - late), 0) ** 1.5
            record = FORCE_S, force + rng.normal(0, NOISE_N, FORCE_S.size), time, depth, std
            try:
                check_time(*record, noise_n=NOISE_N, prior_std_s=0.05)
            except ValueError:
                assert not right
            else:
                assert right


def test_stated_deviations_may_be_wrong_by_two():
    """They count as ten frames do: depths that are twice as rough are no press at another time."""
    for seed in range(30):
        *record, depth, std = recorded(seed)
        rough = depth + np.random.default_rng(seed + 100).normal(0, 1.7 * DEPTH_STD_M, depth.size)
        check_time(*record, rough, std, noise_n=NOISE_N, prior_std_s=0.05)


def test_what_relaxed_is_added_again():
    """By small steps of each element's own equation, the elastic force relaxes to what it was."""
    time_s = np.arange(0, 4, 0.001)
    elastic = 2.0 * np.clip(time_s - 0.5, 0, 1.5)
    held = np.zeros((len(RELAXATION_S), len(time_s)))
    for k, rise in enumerate(np.diff(elastic)):
        for row, relaxation_s in zip(held, RELAXATION_S, strict=True):
            row[k + 1] = row[k] + rise - 0.001 / relaxation_s * row[k]
    force = 0.6 * elastic + 0.4 * held.mean(axis=0)
    assert elastic_force(time_s, force, share=0.4) == pytest.approx(elastic, abs=3e-3)
    assert elastic_force(time_s, force, share=0.0) == pytest.approx(force)


def test_ways_of_a_force():
    time_s = np.arange(0, 2, 0.01)
    force = np.clip(time_s - 0.5, 0, 1)
    ways = force_ways(time_s, force, least_n=0.1)
    relaxed = elastic_force(time_s, force, share=MOST_RELAXED)
    assert ways[0] == pytest.approx(np.maximum(force, 0.1) ** (2 / 3))
    thin = np.sqrt(np.maximum(relaxed, 0.1) / relaxed.max())
    assert ways[3] == pytest.approx(thin)


def test_depths_that_follow_have_the_misfit_of_their_errors():
    """Squares are as many as frames beyond the unknowns; in the air a tip may be anywhere."""
    found = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        force = np.r_[np.zeros(10), np.linspace(0.2, 3.0, 20)]
        ways = np.column_stack([np.maximum(force, 0.1) ** (2 / 3), rng.uniform(0, 1, 30)])
        depth = 0.02 + 0.002 * ways[:, 0] + rng.normal(0, 1e-4, 30)
        depth[:10] = rng.uniform(-0.01, 0.0203, 10)
        found.append(_Frames(depth, np.full(30, 1e-4), 1e-3).followed(force, ways))
    squares, free = np.array([(each.squares, each.free) for each in found]).T
    assert 17 <= free.min() <= free.max() <= 18
    assert squares.mean() == pytest.approx(free.mean(), rel=0.1)
    assert np.mean([each.beyond_chance() for each in found]) < 0.02
    assert all(each.alike > 0.98 for each in found)


def test_a_misfit_is_held_to_the_best():
    """Chi squared of the stated; F of what ten stated frames and the best offset's own say."""
    assert not _Followed(23.0, 7, 1.0).beyond_chance() and _Followed(26.0, 7, 1.0).beyond_chance()
    fitting, rough = _Followed(7.0, 7, 1.0), _Followed(63.0, 7, 1.0)
    for squares, best, beyond in [(38, fitting, False), (44, fitting, True), (44, rough, False)]:
        assert _Followed(squares, 7, 1.0).beyond_chance(best) == beyond
    assert rough.misfit == pytest.approx((63 + 10) / (7 + 10))


def test_a_tip_below_its_contact_without_a_force():
    force = np.r_[np.zeros(10), np.linspace(0.2, 3.0, 20)]
    way = np.maximum(force, 0.1)[:, None] ** (2 / 3)
    depth = 0.02 + 0.002 * way[:, 0]
    frames = _Frames(depth, np.full(30, 1e-4), 1e-3)
    assert frames.followed(force, way).squares < 0.1
    deep = _Frames(np.r_[np.full(10, 0.0235), depth[10:]], np.full(30, 1e-4), 1e-3)
    assert deep.followed(force, way).beyond_chance()


def test_few_frames_with_a_force_tell_nothing():
    force = np.r_[np.zeros(20), 1.0, 2.0, 3.0]
    found = _Frames(np.linspace(0, 1, 23), np.full(23, 1e-4), 0.01).followed(force, force[:, None])
    assert found.misfit == np.inf and not found.beyond_chance()
