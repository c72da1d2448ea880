"""Rigs as they are: each error is in what is recorded, in its amount, and in nothing else."""

import cv2
import numpy as np
import pandas as pd
import pytest
from palpate.vision.camera import camera_from_spec
from virtual_lab.motion import ProbeMotion
from virtual_lab.probe import make_probe
from virtual_lab.record import write_images
from virtual_lab.rig import GAMMA, make_rig
from virtual_lab.rig_errors import errors_of
from virtual_lab.scene import Bench, Scene
from virtual_lab.specification import ErrorSizes
from virtual_lab.wrench import gauge_record

POINT = np.array([-0.05, 0.0, 0.0475])
DOWN = np.diag([1.0, -1.0, -1.0])


@pytest.mark.parametrize("sensor", ["bumblebee", "kinect"])
def test_a_rig_without_errors_is_the_nominal_one(recorded, files_of, small, sensor):
    none, _ = recorded(sensor, small[sensor], folder="none", device={})
    zero = dict.fromkeys(ErrorSizes.model_fields, 0)
    zero, _ = recorded(sensor, small[sensor], folder="zero", device=zero)
    assert files_of(none) == files_of(zero)


def test_rigs_share_their_errors_and_differ_from_others(common, sensors, probe):
    """Also in what has no size in the block: the target's place, which is a little off."""
    sizes = {"baseline": 0.002, "focal": 0.001, "force_gain": 0.015, "radius": 0.01}

    def errors(**block):
        found = errors_of(common | {"seed": block.pop("seed", 1)}, block, sensors["bumblebee"])
        return np.array([found.sensor["stereo"]["baseline_m"] / 0.12 - 1, found.radius])

    one = errors(device=sizes)
    assert np.array_equal(one, errors(device=sizes, shape="another object's"))
    assert not np.isin(one, errors(device=sizes, rig="other")).any()
    assert not np.isin(one, errors(device=sizes, seed=2)).any()
    # One error at a time, and at twice its size.
    alone = errors(device={"baseline": 0.004})
    assert alone == pytest.approx([2 * one[0], 0], rel=1e-9)
    rigs = [errors_of(common, {"rig": name}, sensors["kinect"]) for name in ("lab", "lab", "a")]
    targets = [np.array(rig.probe(probe)["marker_from_force"]) for rig in rigs]
    assert np.array_equal(targets[0], targets[1])
    assert 1e-6 < np.abs(targets[0] - targets[2]).max() < 0.01
    error = np.linalg.inv(np.array(probe["marker_from_force"])) @ targets[0]
    assert 0 < np.linalg.norm(error[:3, 3]) < 4 * common["probe_error"]["shift_m"]
    assert 0 < angle_deg(error) < 4 * common["probe_error"]["angle_deg"]


def angle_deg(pose):
    return np.degrees(np.arccos((np.trace(pose[:3, :3]) - 1) / 2))


def test_errors_have_their_sizes(common, sensors, probe):
    """Over many rigs: standard deviations as the block says."""
    sizes = {"force_gain": 0.015, "force_crosstalk": 0.01, "radius": 0.007, "mass_kg": 0.001}
    block, sensor = {"device": sizes}, sensors["kinect"]
    rigs = [errors_of(common | {"seed": k}, block, sensor) for k in range(400)]
    gains = np.array([rig.gain for rig in rigs])
    assert np.diagonal(gains, axis1=1, axis2=2).std() == pytest.approx(0.015, rel=0.1)
    assert gains[:, 0, 1:3].std() == pytest.approx(0.01, rel=0.1)
    # A newton is so many newton metres at the tip.
    assert gains[:, 4, 0].std() == pytest.approx(0.01 * 0.06, rel=0.1)
    radii = [rig.probe(probe)["indenter"]["radius_m"] for rig in rigs]
    assert np.std(radii) == pytest.approx(0.007 * 0.00622, rel=0.1)
    masses = [rig.force(common["force"])["mass_kg"] for rig in rigs]
    assert np.std(masses) == pytest.approx(0.001, rel=0.1)


def test_the_force_sensors_gain_is_in_its_record(common, sensors, probe):
    sizes = {"force_gain": 0.02, "force_crosstalk": 0.01}
    errors, time_s = errors_of(common, {"device": sizes}, sensors["kinect"]), np.arange(0, 4, 0.001)
    force = np.where(time_s > 2, 5.0, 0.0)[:, None] * [0, 0, 1]
    turn = np.broadcast_to(DOWN, (len(time_s), 3, 3))

    def step(**how):
        given = force, turn, probe, common["force"], np.random.default_rng(0)
        volts = gauge_record(time_s, *given, **how)[[f"v{k}" for k in range(6)]].to_numpy()
        found = volts @ np.array(probe["gauge"]["calibration"]).T
        return (found[time_s > 2].mean(axis=0) - found[time_s <= 2].mean(axis=0))[:3]

    plain = step()
    assert plain == pytest.approx([0, 0, -5], abs=0.01)
    found = step(measured=lambda load: errors.measured(time_s, load, np.random.default_rng(0)))
    assert found == pytest.approx(errors.gain[:3] @ [0, 0, -5, 0, 0, 0], abs=0.01)
    assert np.abs(found - plain).max() > 0.03


def test_a_lag_is_that_of_a_first_order_and_a_drift_grows_over_the_record(common, sensors):
    time_s, kinect = np.arange(0, 2, 0.001), sensors["kinect"]

    def measured(load, seed=0, **sizes):
        found = errors_of(common, {"device": sizes}, kinect)
        return found.measured(time_s, load, np.random.default_rng(seed))

    ramp = 3 + np.clip(time_s - 1, 0, None)[:, None] * [0, 0, -5.0, 0, 0, 0]
    found = measured(ramp, force_lag_s=0.008)
    assert found[time_s < 1] == pytest.approx(ramp[time_s < 1])
    assert (found[-1, 2] - ramp[-1, 2]) / 5 == pytest.approx(0.008, abs=0.0006)
    ends = [measured(np.zeros((2000, 6)), seed=k, force_drift_n=0.03) for k in range(99)]
    gained = np.array([found[-1, :3] - found[0, :3] for found in ends])
    assert gained.std() == pytest.approx(0.03, rel=0.15)
    assert ends[0][1000, :3] == pytest.approx(gained[0] / 2, rel=0.01)
    assert not ends[0][:, 3:].any()


def test_clocks_differ_in_offset_and_rate(recorded, small):
    tables, offsets, of = [], [], ("bumblebee", small["bumblebee"])
    for name, sizes in (("none", {}), ("off", {"clock_offset_s": 0.05, "clock_rate": 50e-6})):
        folder, truth = recorded(*of, folder=name, device=sizes)
        tables.append(pd.read_csv(folder / "force.csv"))
        offsets.append(truth["clock_offset_s"])
    late_s = (tables[1]["time_s"] - tables[0]["time_s"]).to_numpy()
    at_zero = np.interp(0, tables[0]["time_s"], late_s)
    assert at_zero == pytest.approx(offsets[1] - offsets[0], abs=2e-6)
    assert 0.001 < abs(at_zero) < 0.2
    assert 1e-6 < abs(np.polyfit(tables[0]["time_s"], late_s, 1)[0]) < 2e-4
    assert tables[0].iloc[:, 1:].equals(tables[1].iloc[:, 1:])


@pytest.fixture
def pair(common, spec, bench, sensors):
    """Stereo pictures of the indented point: left and right [px], of a sensor in error."""

    def pixels(**sizes):
        errors = errors_of(common, {"device": sizes}, sensors["bumblebee"])
        views = make_rig(common, errors, spec["cameras"]["bumblebee"], bench).views.values()
        return np.array([v.camera.project(v.local(POINT[None]))[0] for v in views]), errors.sensor

    return pixels


def test_the_cameras_of_a_rectified_pair(pair):
    """A longer baseline is a larger disparity; a turn of a camera moves its pictures against it."""
    plain, _ = pair()
    wide, sensor = pair(baseline=0.01)
    error = sensor["stereo"]["baseline_m"] / 0.12 - 1
    assert abs(error) > 1e-3
    disparity = (plain[0] - plain[1])[0] * (1 + error)
    assert plain[0, 0] - wide[1, 0] == pytest.approx(disparity, rel=1e-6)
    assert wide[1, 1] == pytest.approx(plain[0, 1], abs=1e-9)
    turned, sensor = pair(rectification_px=0.2)
    pitch, yaw, roll = sensor["right_turn_rad"] * 790
    x, y = plain[1] - [512, 384]
    assert turned[0] == pytest.approx(plain[0])
    expected = [-yaw + roll / 790 * y, pitch - roll / 790 * x]
    assert turned[1] - plain[1] == pytest.approx(expected, abs=0.02)
    assert 0.02 < np.abs(turned[1] - plain[1]).max() < 1
    longer, sensor = pair(focal=0.002, principal_px=2.0)
    ratio, moved = sensor["color"]["fx_px"] / 790, [sensor["color"][k] for k in ("cx_px", "cy_px")]
    assert longer == pytest.approx((plain - [512, 384]) * ratio + moved)
    assert 1e-4 < abs(ratio - 1) < 0.01
    assert 0.1 < np.abs(np.subtract(moved, [512, 384])).max() < 8


def test_a_lens_bends_the_corner_by_its_size(common, sensors):
    """Outward, by one error of the radial number and one of the tangential two together."""
    size_px, outward_px = np.array([1024, 768]), []
    ray = np.append(size_px / 2 / 790, 1)[None]
    for k in range(200):
        block = {"device": {"distortion_px": 0.5}}
        errors = errors_of(common | {"seed": k}, block, sensors["bumblebee"])
        for camera in ("color", "right"):
            corner = camera_from_spec(errors.sensor[camera]).project(ray)[0]
            outward_px.append((corner - size_px) @ size_px / np.linalg.norm(size_px))
    assert np.std(outward_px) == pytest.approx(0.5 * np.sqrt(2), rel=0.1)
    assert np.corrcoef(np.reshape(outward_px, (-1, 2)).T)[0, 1] == pytest.approx(0, abs=0.25)


def test_the_cameras_of_a_depth_sensor_are_placed_a_little_otherwise(common, sensors):
    stated = sensors["kinect"]
    sizes = {"color_from_depth_deg": 0.1, "color_from_depth_m": 0.001}
    poses = stated, errors_of(common, {"device": sizes}, stated).sensor
    poses = [np.array(sensor["depth"]["color_from_depth"]) for sensor in poses]
    error = np.linalg.inv(poses[0]) @ poses[1]
    assert 0.02 < angle_deg(error) < 0.5
    assert 2e-4 < np.linalg.norm(error[:3, 3]) < 5e-3


def test_a_camera_that_reports_depths_takes_its_files_baseline(common, own):
    """A longer baseline than its file's makes its depths shorter by as much."""
    _, sensor, _ = own
    bench = Bench(np.full((4, 4, 3), 0.6), None)
    place = {"target_m": [0, 0, 0], "distance_m": 0.8, "elevation_deg": 60}
    shown = []
    for sizes in ({}, {"baseline": 0.02}):
        errors = errors_of(common, {"device": sizes}, sensor)
        camera = make_rig(common, errors, place, bench).depth
        image = camera.image(Scene(bench), np.random.default_rng(0))
        shown.append(np.median(image[200:260, 300:360]))
    longer = errors.sensor["depth"]["baseline_m"] / sensor["depth"]["baseline_m"]
    assert abs(longer - 1) > 2e-3
    assert shown[0] / shown[1] == pytest.approx(longer, abs=2e-3)


QUIET = {"read_variance": 0, "shot_variance": 0, "blur_px": 0.55, "flicker": 0}


@pytest.fixture
def imaged(common, spec, bench, small, probe, tmp_path):
    """Images without noise of the probe over the block, its tip at places: their folder."""

    def images_of(tips_m, sizes, sensor="bumblebee", *, frames=None):
        errors = errors_of(common, {"device": sizes}, small[sensor])
        rig = make_rig(common | {"camera_noise": QUIET}, errors, spec["cameras"][sensor], bench)
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        folder.mkdir()
        count = len(tips_m)
        turn = np.broadcast_to(DOWN, (count, 3, 3))
        path = ProbeMotion(np.arange(count), np.zeros(count), np.array(tips_m), turn)
        numbers = np.arange(count if frames is None else frames)
        write_images(folder, rig, None, path, make_probe(probe), seed=[1, 2], numbers=numbers)
        return folder

    return images_of


def linear(folder, stream="left", number=0):
    """Radiance that a grey value of the mosaic stands for."""
    image = cv2.imread(str(folder / stream / f"{number:06d}.png"), cv2.IMREAD_UNCHANGED)
    return (image / 255.0) ** GAMMA


AWAY = np.array([0.0, 0.0, 0.08])


def test_a_frame_is_the_mean_of_its_exposure(imaged):
    """The tip goes 6 mm while it is exposed: three moments, evenly over it."""
    places = [AWAY + [x, 0, 0] for x in (0.0, -0.002, 0.002)]
    sizes = {"exposure_s": 0.03}
    whole = linear(imaged([*places, AWAY], sizes, frames=1))
    parts = [linear(imaged([place] * 3 + [AWAY], sizes, frames=1)) for place in places]
    assert np.abs(whole - np.mean(parts, axis=0)).max() < 0.015
    assert np.abs(whole - parts[0]).max() > 0.1


def test_depth_may_come_after_its_colours(imaged):
    """Colours of where the probe was, depth of where it then is."""
    later = AWAY + [0.01, 0, 0]
    both = imaged([AWAY, later], {"depth_delay_s": 0.03}, "kinect", frames=1)
    first, last = (imaged([place], {}, "kinect") for place in (AWAY, later))
    assert read(both, "color") == read(first, "color") != read(last, "color")
    assert read(both, "depth") == read(last, "depth") != read(first, "depth")


def read(folder, stream, number=0):
    return (folder / stream / f"{number:06d}.png").read_bytes()


def test_lost_frames_leave_a_gap_in_the_numbers(recorded, small, spec):
    of, motion = ("kinect", small["kinect"]), spec["motion"] | {"frames": 12}
    whole, _ = recorded(*of, folder="whole", motion=motion, device={})
    folder, truth = recorded(*of, folder="lost", motion=motion, device={"dropped_frames": 0.3})
    all_rows, rows = (pd.read_csv(f / "frames.csv") for f in (whole, folder))
    assert 5 <= len(rows) < 12
    assert rows["frame"].is_monotonic_increasing
    assert all_rows[all_rows["frame"].isin(rows["frame"])].reset_index(drop=True).equals(rows)
    assert all(read(folder, "color", k) == read(whole, "color", k) for k in rows["frame"])
    assert len(list((folder / "color").iterdir())) == len(rows)
    # The truth is that of the frames that are there.
    assert truth["time_s"] == pytest.approx(rows["time_s"], abs=1e-6)
    assert {len(truth[key]) for key in ("tip_m", "force_n", "depth_m", "surface_m")} == {len(rows)}
    assert truth["mask_shape"][0] == len(rows)


def test_the_light_changes_over_a_recording(imaged):
    """Evenly from the first frame to the last, by one draw times the size."""
    changes = []
    for size in (0.0, 0.03, 0.06):
        folder = imaged([AWAY] * 3, {"light_change": size})
        means = [linear(folder, number=k).mean() for k in range(3)]
        changes.append(np.array(means[1:]) / means[0] - 1)
    assert changes[0] == pytest.approx([0, 0], abs=1e-4)
    assert 0.002 < abs(changes[1][1]) < 0.12
    assert changes[1][0] == pytest.approx(changes[1][1] / 2, abs=1e-3)
    assert changes[2] == pytest.approx(2 * changes[1], abs=2e-3)


def moved_px(before, after):
    """By how much a picture moved along x and y, to first order."""
    down, right = (g.ravel() for g in np.gradient(before))
    return np.linalg.lstsq(np.column_stack([right, down]), (before - after).ravel())[0]


def test_a_camera_shakes_as_a_whole(imaged):
    frames = 8
    still, shaken = (imaged([AWAY] * frames, {"shake_px": size}) for size in (0.0, 0.2))
    moved = {}
    for stream in ("left", "right"):
        pictures = [
            [cv2.GaussianBlur(linear(f, stream, k), (0, 0), 2) for k in range(frames)]
            for f in (still, shaken)
        ]
        moved[stream] = np.array([moved_px(a, b) for a, b in zip(*pictures, strict=True)])
    assert moved["left"].std() == pytest.approx(0.2, rel=0.35)
    assert moved["left"] == pytest.approx(moved["right"], abs=0.03)
