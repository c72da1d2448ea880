"""What a probe gives way by, from presses whose stiffness is known."""

import numpy as np
import pytest
from palpate.vision.bending import find_bending

STIFFNESS_N_M = 2e4
FAR_M = 0.013


def press(count=300, *, most_n=5.0, back=True, force_std_n=0.0, seed=0):
    """Force of a slow press and the way back, its zero off, and the same with noise."""
    place = np.linspace(0, 1, count)
    clean = most_n * (np.sin(np.pi * place) if back else place)
    return clean, clean + np.random.default_rng(seed).normal(0, force_std_n, count)


def seen(way_m, std_m=5e-5, seed=1):
    """A way as a board tells it, from any zero."""
    return FAR_M + way_m + np.random.default_rng(seed).normal(0, std_m, len(way_m))


def test_a_press_without_noise():
    force, _ = press()
    found = find_bending(seen(force / STIFFNESS_N_M, 0.0), force)
    assert found.stiffness_n_m == pytest.approx(STIFFNESS_N_M, rel=1e-6)
    assert found.samples == pytest.approx((force > 0.5).sum(), abs=2)
    assert found.told


@pytest.mark.parametrize("alike", [0.0, 0.7])
@pytest.mark.parametrize("stiffness_n_m", [3e3, 2e4, 1e5])
def test_deviations_hold(stiffness_n_m, alike):
    """Of independent errors, and of ones that hang together from frame to frame."""
    rng, parts = np.random.default_rng(4), []
    for seed in range(300):
        clean, force = press(force_std_n=0.02, seed=seed)
        error = rng.normal(0, 5e-5, len(clean))
        for k in range(1, len(error)):
            error[k] = alike * error[k - 1] + np.sqrt(1 - alike**2) * error[k]
        found = find_bending(FAR_M + clean / stiffness_n_m + error, force)
        off = found.compliance_m_n - 1 / stiffness_n_m
        parts.append(off / found.compliance_std_m_n)
    # Of 300 draws a deviation's own is 4 %; what hangs together is told less sharply.
    np.testing.assert_allclose(np.std(parts), 1, atol=0.12 if alike == 0 else 0.2)
    assert abs(np.mean(parts)) < 4 / np.sqrt(300)


def test_noise_of_the_force_does_not_flatten():
    """Of a tenth of a newton in a press of three; a plain line is off by a hundredth."""
    slopes, plain = [], []
    for seed in range(200):
        clean, force = press(most_n=3.0, force_std_n=0.1, seed=seed)
        way = seen(clean / STIFFNESS_N_M, 1e-5, seed + 1000)
        slopes.append(find_bending(way, force).compliance_m_n * STIFFNESS_N_M)
        kept = force > 0.5
        plain.append(np.polyfit(force[kept], way[kept], 1)[0] * STIFFNESS_N_M)
    error = np.std(slopes) / np.sqrt(200)
    assert abs(np.mean(slopes) - 1) < 4 * error
    assert abs(np.mean(plain) - 1) > 4 * error


def test_what_nothing_gives_way_in_is_not_told():
    told = []
    for seed in range(100):
        found = find_bending(seen(0.0 * press()[0], seed=seed), press()[0])
        told.append(found.told)
        assert found.least_n_m > 1e5
    assert np.mean(told) < 0.03


def test_bounds_of_what_is_hardly_told():
    """Nineteen of twenty hold."""
    truth, held = 2.5e5, []
    for seed in range(300):
        clean, force = press(force_std_n=0.02, seed=seed)
        found = find_bending(seen(clean / truth, seed=seed + 1000), force)
        held.append(found.least_n_m < truth)
    assert 0.92 < np.mean(held) < 0.98


def test_loading_alone():
    force, _ = press(back=False)
    found = find_bending(seen(force / STIFFNESS_N_M), force)
    assert np.isnan(found.gap_m[0])
    assert abs(found.stiffness_n_m - STIFFNESS_N_M) < 4 * found.std_n_m


def test_presses_one_after_another():
    force = np.tile(press()[0], 3)
    found = find_bending(seen(force / STIFFNESS_N_M), force)
    assert abs(found.stiffness_n_m - STIFFNESS_N_M) < 4 * found.std_n_m
    assert abs(found.gap_m[0]) < 4 * found.gap_m[1]


def test_weights_that_hang():
    force = np.repeat(np.linspace(1, 5, 5), 2)
    found = find_bending(seen(force / STIFFNESS_N_M, 5e-6), force)
    assert abs(found.stiffness_n_m - STIFFNESS_N_M) < 4 * found.std_n_m


def test_no_press_of_a_rigid_thing_is_refused_by_chance():
    for seed in range(300):
        clean, force = press(force_std_n=0.02, seed=seed)
        find_bending(seen(clean / STIFFNESS_N_M, 2e-4, seed + 1000), force)


def test_few_samples_in_contact():
    force, _ = press(20, most_n=0.52)
    with pytest.raises(
        ValueError, match=r"expected 10 samples or more above 0.5 N, found \d+ of 20$"
    ):
        find_bending(seen(force / STIFFNESS_N_M), force)


def test_force_that_is_negative_in_a_press():
    force, _ = press()
    line = r"found 0 of 300 \(presses are positive here: turn the sign\?\)"
    with pytest.raises(ValueError, match=line):
        find_bending(seen(force / STIFFNESS_N_M), -force)


def test_too_little_force():
    force, _ = press(most_n=1.3)
    with pytest.raises(ValueError, match=r"expected a press over 1 N .* found 0\.79 N; press"):
        find_bending(seen(force / STIFFNESS_N_M), force)


def test_force_that_is_noise():
    _, force = press(most_n=2.0, force_std_n=0.2)
    with pytest.raises(ValueError, match=r"force: expected a press over [345][.\d]* N or more"):
        find_bending(seen(force / STIFFNESS_N_M), force)


def test_force_in_other_units():
    force, _ = press(most_n=5000)
    with pytest.raises(ValueError, match="expected newtons of a hand, found 5000 N"):
        find_bending(seen(force / STIFFNESS_N_M), force)


def test_foam():
    """A ball in 40 kPa: way over the power 2/3 of force, 7 mm at 5 N."""
    force, _ = press()
    way = seen((3 * force / (4 * 4e4 * np.sqrt(0.006))) ** (2 / 3), 2e-4)
    with pytest.raises(ValueError, match="way: expected it in proportion to the force, found it"):
        find_bending(way, force)


def test_a_spring():
    force, _ = press()
    with pytest.raises(ValueError, match=r"way: expected 2000 N/m or more, found 800:"):
        find_bending(seen(force / 800, 5e-6), force)


def test_a_way_in_other_units():
    force, _ = press()
    with pytest.raises(ValueError, match="the unit of the way right"):
        find_bending(1e3 * seen(force / STIFFNESS_N_M), force)


def test_a_way_that_shrinks():
    force, _ = press()
    with pytest.raises(ValueError, match="way: expected it to grow with the force, found it 0.2"):
        find_bending(-seen(force / STIFFNESS_N_M), force)


@pytest.mark.parametrize("how", ["slides", "lags"])
def test_loading_and_unloading_apart(how):
    force, _ = press()
    way = force / STIFFNESS_N_M
    if how == "slides":
        way = way + 1e-4 * (np.arange(300) > 150)
    else:
        way = np.roll(way, 15)
    with pytest.raises(ValueError, match="expected loading and unloading alike, found unloading"):
        find_bending(seen(way, 2e-5), force)
