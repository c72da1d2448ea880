"""What hangs on the sensor, from readings at rest whose load is known."""

import numpy as np
import pytest
from palpate.vision.indentation import weight_wrenches
from palpate.vision.load import find_load
from palpate.vision.load_json import verdict
from scipy.spatial.transform import Rotation
from turned_handle import held_free

UP = np.array([0.1, -0.8, -0.5])
UP = UP / np.linalg.norm(UP)
LOAD = {"mass_kg": 0.0304, "centre_of_mass_m": [0.0005, 0.0, 0.0365]}
TURN = Rotation.from_euler("xy", [110, 3], degrees=True).as_matrix()
BIAS = np.array([1.2, -2.0, 4.0, 0.05, -0.03, 0.02])
# Of a mean over half a second: newtons across the sensor, along it, newton metres.
NOISE = np.array([0.0015, 0.0015, 0.004, 2e-5, 2e-5, 1e-5])
# The lab's: 2 mV of noise, a converter of 12 bits over 20 V, and zeros of up to 0.4 V.
VOLTS, STEP_V, ZERO_V, SAMPLES = 0.002, 20 / 4096, 0.4, 2000


def readings(poses, load=LOAD):
    """Wrenches of a load at poses, force frame."""
    return weight_wrenches(poses[:, :3, :3] @ TURN, UP, load) + BIAS


def turn_deg(found):
    return np.degrees(Rotation.from_matrix(found.marker_from_force.T @ TURN).magnitude())


def errors(found):
    """The thirteen unknowns less the truth, the rotation in the force frame."""
    turn = Rotation.from_matrix(found.marker_from_force.T @ TURN).as_rotvec()
    centre = found.centre_of_mass_m - LOAD["centre_of_mass_m"]
    off = found.bias - BIAS
    return np.concatenate([[found.mass_kg - LOAD["mass_kg"]], turn, off[:3], centre, off[3:]])


def test_readings_without_noise_tell_all():
    poses = held_free()
    found = find_load(poses, readings(poses), UP)
    np.testing.assert_allclose(errors(found), 0, atol=1e-9)


def test_six_poses_do():
    poses = held_free(6)
    wrench = readings(poses) + NOISE * np.random.default_rng(0).standard_normal((6, 6))
    found = find_load(poses, wrench, UP)
    assert abs(found.mass_kg - LOAD["mass_kg"]) < 1e-3


@pytest.mark.parametrize("known", [True, False])
def test_deviations_hold(known):
    noise = NOISE if known else np.repeat([0.002, 2e-5], 3)
    poses, rng = held_free(), np.random.default_rng(3)
    parts = []
    for _ in range(200):
        wrench = readings(poses) + noise * rng.standard_normal((len(poses), 6))
        found = find_load(poses, wrench, UP, noise if known else None)
        parts.append(errors(found) / found.std)
    spread = np.std(parts, axis=0)
    # Of 200 draws a deviation's own is 5 %, and twelve poses tell the noise to 13 %.
    np.testing.assert_allclose(spread, 1, atol=0.2)
    assert (np.abs(np.mean(parts, axis=0)) < 4 / np.sqrt(200)).all()


def test_deviations_hold_where_poses_are_off():
    clean = readings(held_free())
    parts = []
    for seed in range(100):
        poses = held_free(noise_deg=0.1, seed=seed)
        wrench = clean + NOISE * np.random.default_rng(seed).standard_normal(clean.shape)
        found = find_load(poses, wrench, UP, NOISE)
        parts.append(errors(found)[:4] / found.std[:4])
    np.testing.assert_allclose(np.std(parts, axis=0), 1, atol=0.3)


@pytest.mark.parametrize("count", [6, 7, 12])
@pytest.mark.parametrize("known", [True, False])
def test_deviations_hold_of_few_poses(count, known):
    """Each unknown's error over its deviation, squared; of known noise that is three times more."""
    noise, rng = NOISE * 3, np.random.default_rng(11)
    given = NOISE if known else None
    poses, parts = held_free(count), []
    for _ in range(300):
        wrench = readings(poses) + noise * rng.standard_normal((count, 6))
        found = find_load(poses, wrench, UP, given)
        parts.append((errors(found) / found.std) ** 2)
    # Of 300 draws a mean square's own deviation is 8 %, and more where six poses tell the noise.
    assert np.mean(parts) == pytest.approx(1, abs=0.15)


TOUCH = np.array([0.03, 0.032, 0.024, 1e-3, -5e-4, 2e-4])


@pytest.mark.parametrize("place", range(12))
def test_a_pose_that_is_touched_is_named_and_changes_nothing(place):
    poses, rng = held_free(), np.random.default_rng(place)
    wrench = readings(poses) + NOISE * rng.standard_normal((12, 6))
    others = np.arange(12) != place
    clean = find_load(poses[others], wrench[others], UP, NOISE)
    wrench[place] += TOUCH
    found = find_load(poses, wrench, UP, NOISE)
    np.testing.assert_array_equal(found.kept, others)
    np.testing.assert_allclose(found.covariance, clean.covariance, rtol=1e-6, atol=1e-16)
    assert np.linalg.norm(found.residuals[place, :3]) > 0.03


@pytest.mark.parametrize("noise", [NOISE, None])
def test_a_pose_that_is_not_touched_counts(noise):
    for seed in range(100):
        poses = held_free(noise_deg=0.1, seed=seed)
        rng = np.random.default_rng(seed)
        wrench = readings(held_free()) + NOISE * rng.standard_normal((12, 6))
        assert find_load(poses, wrench, UP, noise).kept.all()


def test_two_poses_that_are_touched():
    poses, rng = held_free(), np.random.default_rng(0)
    wrench = readings(poses) + NOISE * rng.standard_normal((12, 6))
    wrench[[3, 8]] += TOUCH, -8 * TOUCH
    names = [f"frames {10 * k} to {10 * k + 9}" for k in range(12)]
    with pytest.raises(ValueError) as caught:
        find_load(poses, wrench, UP, NOISE, names)
    expected = "force: expected the weight of one load at rest in all poses, found another at"
    assert f"{expected} frames 30 to 39, by " in str(caught.value)


def test_gauges_of_the_lab_tell_what_is_asked(probe):
    """Mass within 1 g, centre within 1 mm, rotation within 0.3 degrees, and as stated."""
    rng = np.random.default_rng(7)
    calibration = np.array(probe["gauge"]["calibration"])
    # Two seconds at each pose, in which twelve frames tell it.
    poses = held_free(12, noise_deg=0.03)
    load = weight_wrenches(held_free(12)[:, :3, :3] @ TURN, UP, LOAD)
    volts = load @ np.linalg.inv(calibration).T + rng.uniform(-ZERO_V, ZERO_V, 6)
    samples = volts[:, None] + rng.normal(0, VOLTS, (12, SAMPLES, 6))
    wrench = np.round(samples / STEP_V) * STEP_V @ calibration.T
    noise = wrench.std(axis=1).mean(axis=0) / np.sqrt(SAMPLES)
    found = find_load(poses, wrench.mean(axis=1), UP, noise)
    assert abs(found.mass_kg - LOAD["mass_kg"]) < 1e-3
    assert np.linalg.norm(found.centre_of_mass_m - LOAD["centre_of_mass_m"]) < 1e-3
    assert turn_deg(found) < 0.3
    off = (errors(found) / found.std)[[0, 1, 2, 3, 7, 8, 9]]
    assert (np.abs(off) < 3.5).all()


@pytest.mark.parametrize(("channel", "gain"), [(0, 1.1), (2, 0.9)])
def test_a_channel_of_another_scale_is_named(channel, gain):
    poses, scale = held_free(), np.ones(6)
    scale[channel] = gain
    rng = np.random.default_rng(4)
    noise = NOISE * rng.standard_normal((len(poses), 6))
    plain = readings(poses)
    assert not any("scale" in line for line in verdict(find_load(poses, plain + noise, UP, NOISE)))
    (line,) = (
        line
        for line in verdict(find_load(poses, scale * plain + noise, UP, NOISE))
        if "scale" in line
    )
    assert f"f{'xyz'[channel]} reads {'+' if gain > 1 else '-'}" in line


def refusal(poses, wrench, up=UP):
    with pytest.raises(ValueError) as caught:
        find_load(poses, wrench, up)
    return str(caught.value)


def test_five_poses():
    poses = held_free(5)
    assert "at least 6, found 5" in refusal(poses, readings(poses))


def test_poses_that_are_alike():
    poses = held_free()[[3] * 12]
    line = refusal(poses, readings(poses))
    assert "found 0.0 (root mean square); hold it with the tip down" in line


def test_a_probe_that_turns_about_the_vertical():
    poses = held_free()
    spins = Rotation.from_rotvec(UP * np.linspace(0, 5, 12)[:, None]).as_matrix()
    poses[:, :3, :3] = spins @ poses[5, :3, :3]
    assert "expected the vertical to turn" in refusal(poses, readings(poses))


def test_no_load():
    poses = held_free()
    wrench = BIAS + NOISE * np.random.default_rng(1).standard_normal((12, 6))
    assert "mN where readings are off by" in refusal(poses, wrench)


def test_torques_in_another_unit():
    poses = held_free()
    wrench = readings(poses) * [1, 1, 1, 1e3, 1e3, 1e3]
    line = refusal(poses, wrench)
    assert "torque: expected a centre of mass within 0.5 m of the sensor, found it 36.5 m" in line
    assert "(its unit?)" in line


@pytest.mark.parametrize("wrong", ["sign", "signs", "upside down", "vertical", "touched"])
def test_what_no_weight_explains(wrong):
    poses, up = held_free(), UP
    wrench = readings(poses)
    if wrong == "sign":
        wrench[:, 0] *= -1
    elif wrong == "signs":
        wrench *= -1
    elif wrong == "upside down":
        up = -UP
    elif wrong == "vertical":
        up = np.array([1.0, 0, 0])
    else:
        wrench[[1, 4, 7, 9], :3] += [0.5, 0.2, 0]
    line = refusal(poses, wrench, up)
    assert "mN not explained (sign or order of a channel, the vertical turned round" in line
