"""The long look into captures: what people get wrong in files that are right by their format."""

import re
import shutil

import cv2
import numpy as np
import pandas as pd
import pytest
import trimesh
import yaml
from palpate.capture.check import check_object
from palpate.capture.devices import read_device
from palpate.capture.findings import examine_force, examine_template
from palpate.capture.tables import GAUGE_COLUMNS, WRENCH_COLUMNS
from palpate.examine import examine_frames, examine_object, examine_scene
from palpate.vision.force import zeroed

SIDE = 0.08


@pytest.fixture
def cube(tmp_path):
    """Folder of a cube on the table, 8 cm wide, and its object.yaml."""
    box = trimesh.creation.box((SIDE,) * 3).subdivide().subdivide()
    box.apply_translation([0, 0, SIDE / 2])
    box.export(tmp_path / "template.ply")
    spec = {
        "template": {"file": "template.ply", "unit": "m", "vertices": 100},
        "support": {"plane_point_m": [0] * 3, "plane_normal": [0, 0, 1], "tolerance_m": 0.001},
        "points": {"top": {"position_m": [0.01, 0.0, SIDE]}},
    }
    return tmp_path, spec


def test_a_right_template_is_described_inside_out_too(cube):
    folder, spec = cube
    found = examine_template(folder, spec)
    assert not found.wrong and not found.warnings
    text = " ".join(found.found)
    assert "closed, 98 vertices, 80 x 80 x 80 mm, 512 cm3" in text
    # The bottom's 64 square centimetres are held.
    assert "bonded, 64 cm2" in text
    assert "points: top; at most 0.0 mm off" in text
    mesh = trimesh.load(folder / "template.ply")
    mesh.invert()
    mesh.export(folder / "template.ply")
    assert examine_template(folder, spec) == found


def test_a_press_along_the_surface_is_doubtful(cube):
    folder, spec = cube
    spec["points"]["top"]["direction"] = [1, 0, -0.2]
    (line,) = examine_template(folder, spec).warnings
    assert "points.top.direction: expected a press within 45 degrees" in line
    assert line.endswith("found 79")


def pressed(*, rate=500, peak=2.0, start=1.0, seconds=4.0, noise=0.01, sideways=0.0):
    """A record that rests, is pushed sideways, ramps up and holds; the sensor hangs upside down."""
    time = np.arange(0, seconds, 1 / rate)
    table = pd.DataFrame({"time_s": time})
    noisy = noise * np.random.default_rng(3).standard_normal((len(time), 6))
    table[list(WRENCH_COLUMNS)] = noisy + [0, 0, 0.3, 0, 0, 0]
    table["fx_n"] += sideways * np.clip(time / 0.5, 0, 1)
    table["fz_n"] -= peak * np.clip((time - start) / 1.5, 0, 1)
    return table


FRAMES_S = np.linspace(0, 3.9, 20)


def examined_force(folder, record, probe, frames_s=FRAMES_S):
    """What is told of a record whose zero is that of its first half second."""
    known = zeroed(record, probe, 0.5, frames_s[0])
    arrays = known.time_s, known.wrench[:, :3], known.within(known.time_s)
    return examine_force(folder, *arrays, frames_s, onset_n=0.1)


def test_a_right_press_is_described_in_volts_too(tmp_path, probe):
    found = examined_force(tmp_path, pressed(), {})
    assert not found.wrong and not found.warnings
    assert "force 500 Hz" in found.found[0] and "peak 2.0" in found.found[0]
    wrench = pressed()
    inverse = np.linalg.inv(np.array(probe["gauge"]["calibration"]))
    volts = wrench[list(WRENCH_COLUMNS)].to_numpy() @ inverse.T
    table = pd.DataFrame(volts, columns=GAUGE_COLUMNS).assign(time_s=wrench["time_s"])
    assert "peak 2.0" in examined_force(tmp_path, table, probe).found[0]


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (pressed(sideways=1.0), "force: expected an unloaded probe where the zero is taken"),
        (pressed(rate=50), "time_s: expected 100 Hz or more, found 50 Hz"),
        (pressed(start=3.5), "frames: expected at least 5 in the press, found 2"),
    ],
)
def test_doubtful_presses(tmp_path, record, words):
    lines = examined_force(tmp_path, record, {}).warnings
    assert any(words in line for line in lines)


@pytest.fixture
def own(root, tmp_path):
    """The own object's folder with its first capture alone."""
    folder = tmp_path / "raw/toy_cow"
    ignored = shutil.ignore_patterns("back-a02")
    return shutil.copytree(root / "tests/own_object/raw/toy_cow", folder, ignore=ignored)


def known(folder):
    """Files of a folder by name."""
    return {path.stem: yaml.safe_load(path.read_text()) for path in folder.glob("*.yaml")}


@pytest.fixture
def devices(root):
    return [known(root / "tests/own_object" / kind) for kind in ("sensors", "probes")]


@pytest.fixture
def checked(root, said):
    """What a check says with the own object's devices."""
    devices = [f"--{kind}={root}/tests/own_object/{kind}" for kind in ("sensors", "probes")]
    return lambda *words, **status: said("check", *words, *devices, **status)


def test_an_object_is_examined_as_a_whole(own, checked):
    told = checked(f"--raw={own.parent}")
    assert f"{own}: nothing wrong" in told
    assert "bench_cam/back: 12 frames" in told
    assert "worth a look" not in told
    path = own / "object.yaml"
    path.write_text(path.read_text().replace("unit: m", "unit: mm"))
    (own / "bench_cam/back/force.csv").unlink()
    told = checked(f"--raw={own.parent}", status=1)
    assert "template.unit: expected" in told
    assert "force.csv: file: expected a CSV table, found nothing" in told


@pytest.mark.parametrize(
    ("tip_m", "count_m", "line"),
    [
        (0.01, 1e-3, "tip within 5 mm of the surface when the force begins, found it 10"),
        (0, 2e-3, r"or depth.count_m: expected the board .*depth.count_m of 0.00.* for 0.002\?"),
        (0, 1e-2, r"found 6.7. m in the middle \(depth.count_m 0.01\?\)"),
        (0, 1.02e-3, "the force begins, found 9.1 mm .*square_m, the optics or depths by"),
        pytest.param(-0.01, 1e-3, "found 8.2 mm .force_from_tip", marks=pytest.mark.long),
    ],
)
def test_what_only_depths_alignment_and_first_contact_tell(own, devices, tip_m, count_m, line):
    """A tip that is longer than stated, or shorter; depths that are too long."""
    sensors, probes = devices
    probes["bench_probe"]["force_from_tip"][2][3] += tip_m
    sensors["bench_cam"]["depth"] |= {"encoding": "counts", "count_m": count_m}
    found = examine_object(own, *devices).wrong
    assert re.search(line, found[0]), found


def test_a_sensor_without_captures(own, devices):
    shutil.rmtree(own / "bench_cam/back")
    (line,) = examine_object(own, *devices).wrong
    assert "bench_cam: folder: expected captures, found none" in line


def test_an_empty_raw(checked, tmp_path):
    line = "folder: expected objects (<object>/object.yaml), found none"
    assert line in checked(f"--raw={tmp_path}", status=1)


def test_names_are_kept_wherever_one_comes_in(block, root, tmp_path):
    specifications = known(root / "tests/sample/sensors"), known(root / "config/probes")
    path = block / "object.yaml"
    path.write_text(path.read_text().replace("object: foam_block", "object: simulations"))
    (line,) = check_object(block.rename(block.with_name("simulations")), *specifications)
    assert "object: expected a name of letters, digits and _ other than sensors and sim" in line
    text = (root / "tests/sample/sensors/kinect.yaml").read_text()
    (tmp_path / "curve.yaml").write_text(text.replace("sensor: kinect", "sensor: curve"))
    _, (line,) = read_device(tmp_path / "curve.yaml", "sensors")
    assert "curve.yaml: sensor: expected a name of small letters, digits and _ other than" in line


def test_a_check_from_within_the_objects_folder(block, root, said, monkeypatch):
    devices = f"--sensors={root}/tests/sample/sensors", f"--probes={root}/config/probes"
    monkeypatch.chdir(block)
    assert "kinect/08: 10 frames over 3.00 s" in said("check", ".", *devices)
    (block / "kinect/08/force.csv").unlink()
    assert "force.csv" in said("check", block, *devices, status=1)


SENSOR = {
    "kind": "depth",
    "frame_rate_hz": 10,
    "range_m": [0.5, 1.5],
    "color": {"encoding": "mono8"},
    "depth": {"encoding": "millimetre"},
}


def folder_of(path, color, depth=None, times=(0.0, 0.1)):
    """Frames of one picture each."""
    rows = [(k, time, f"color/{k}.png", f"depth/{k}.png") for k, time in enumerate(times)]
    depth = np.full((40, 60), 800, np.uint16) if depth is None else depth
    for name, image in (("color", color), ("depth", depth)):
        (path / name).mkdir(parents=True, exist_ok=True)
        for k in range(len(times)):
            cv2.imwrite(str(path / f"{name}/{k}.png"), image)
    table = pd.DataFrame(rows, columns=["frame", "time_s", "color", "depth"])
    table.to_csv(path / "frames.csv", index=False)
    return path


def grey(level=100):
    return np.full((40, 60), level, np.uint8)


def test_gaps_between_frames(tmp_path):
    even = examine_frames(folder_of(tmp_path, grey(), times=[0.0, 0.2, 0.4, 0.7]), SENSOR)
    assert even.found[0] == "4 frames over 0.70 s (5.0 Hz), 60 x 40 px" and not even.warnings
    (line,) = examine_frames(folder_of(tmp_path, grey(), times=[0, 0.2, 0.4, 1.2]), SENSOR).warnings
    assert line.endswith("time_s: expected frames about 0.200 s apart, found a gap of 0.80 s")
    (line,) = examine_frames(folder_of(tmp_path, grey(), times=[0, 0.05, 0.1]), SENSOR).warnings
    assert line.endswith("at most 10 Hz (the sensor's frame_rate_hz), found 20.0 Hz")


@pytest.mark.parametrize(("level", "fine"), [(14, False), (15, True), (240, True), (241, False)])
def test_frames_that_are_dark_or_overexposed(tmp_path, level, fine):
    assert (not examine_frames(folder_of(tmp_path, grey(level)), SENSOR).warnings) == fine


@pytest.mark.parametrize(
    ("pixels", "line"),
    [
        (0, "object and probe, which the background must not hold, found 0.00% of the picture"),
        (20, None),
        (33, "the background's scene .same place, same light., found [67].% of the picture"),
    ],
)
def test_a_scene_against_its_background(tmp_path, pixels, line):
    """Of sixty columns so many have changed by sixty grey levels."""
    picture = grey()
    picture[:, : pixels + 5 * (pixels > 30)] += 60
    folders = folder_of(tmp_path / "a", picture), folder_of(tmp_path / "b", grey())
    found = examine_scene(*folders, SENSOR)
    if line is None:
        new = "% of the picture is new against the background"
        assert not found.warnings and found.found[0].endswith(new)
        # Blurred by seven pixels, a third of a step of sixty reaches one column farther.
        assert int(found.found[0].split("%")[0]) == pytest.approx(100 * 21 / 60, abs=2)
    else:
        assert re.search(line, found.warnings[0]) and not found.found


@pytest.mark.parametrize(
    ("rows", "depth_mm", "line"),
    [
        (20, 900, None),
        (7, 900, None),
        (5, 900, "depth: expected readings in 30% of the middle or more, found 25%"),
        (0, 900, "depth: expected readings in the middle, found none"),
        (20, 90, "found 0.09 m in the middle (what does a count stand for?)"),
    ],
)
def test_depths_of_the_middle(tmp_path, rows, depth_mm, line):
    """Of its 20 rows so many have readings."""
    image = np.zeros((40, 60), np.uint16)
    image[: 10 + rows] = depth_mm
    found = examine_frames(folder_of(tmp_path, grey(), image), SENSOR)
    wrong = found.wrong + found.warnings
    assert [one.endswith(line) for one in wrong] == [True] if line else not wrong
    if rows and depth_mm == 900:
        assert found.found[-1] == f"depth is known in {5 * rows}% of the middle, 0.90 m"
