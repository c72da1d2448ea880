"""Recordings about sensors: what is wrong with them, one line each."""

import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.discover import CaptureId, discover, folder_fingerprint, stamp
from palpate.capture.experiments import check_experiment
from palpate.capture.images import write_image


@pytest.fixture(scope="session")
def kinect(root):
    return yaml.safe_load((root / "tests/sample/sensors/kinect.yaml").read_text())


def frames(folder, count, streams, size=(480, 640)):
    """Grey frames of some streams."""
    rows = []
    for k in range(count):
        row = {"frame": k, "time_s": k / 10}
        for stream in streams:
            (folder / stream).mkdir(parents=True, exist_ok=True)
            row[stream] = f"{stream}/{k:06d}.png"
            write_image(folder / row[stream], np.full(size, 90, np.uint8), "mono8")
        rows.append(row)
    pd.DataFrame(rows).to_csv(folder / "frames.csv", index=False)


@pytest.fixture
def calibration(tmp_path):
    folder = tmp_path / "calibration"
    frames(folder, 6, ("color", "infrared"))
    (folder / "board.csv").write_text("columns,rows,square_m\n9,6,0.025\n")
    return folder


@pytest.fixture
def workspace(tmp_path):
    folder = tmp_path / "workspace"
    for point in ("01", "02"):
        frames(folder / point, 2, ("color",))
    (folder / "grid.csv").write_text("point,row,column,x_m,y_m\n01,1,1,0,0\n02,1,2,0.1,0\n")
    return folder


def test_right_ones(calibration, workspace, kinect, root, tmp_path):
    assert check_experiment(calibration, kinect) == []
    assert check_experiment(workspace, kinect) == []
    sample = root / "tests/sample/raw/foam_block/kinect"
    copies = {"loading": "08", "cd_case/trace": "08", "cd_case/background": "background"}
    for name, source in (copies | {"planes/01": "background"}).items():
        shutil.copytree(sample / source, tmp_path / name)
    (tmp_path / "planes/planes.csv").write_text("plane,distance_m\n01,0.6\n")
    for name in ("loading", "cd_case", "planes"):
        assert check_experiment(tmp_path / name, kinect) == []


POINTS = ([1, 1], [1.4, 2], [-1, 2], [1e300, 2])
GRIDS = ["".join(f"{k},1,1,0,0\n" for k in one) for one in POINTS]
UNSAID = ("", "- simulated\n", "provenance: maybe\n")
BOARD, GRID, SAID = "calibration/board.csv", "workspace/grid.csv", "workspace/recording.yaml"
WRONG = [
    (BOARD, "9,-6,0.025\n", "expected whole numbers of inner corners >= 3, found 9 x -6"),
    (BOARD, "", "board.csv: rows: expected at least one, found none"),
    (BOARD, "9,6,25\n", "square_m: expected 0.001 to 0.5 metres, found 25 (millimetres?)"),
    (BOARD, "9,6,2.5e-5\n", "square_m: expected 0.001 to 0.5 metres, found 2.5e-05"),
    (BOARD, "9,6,0.02\n8,6,0.02\n", "expected one board, found 2"),
    (BOARD, "9,x,0.025\n", "rows: expected finite numbers, found x"),
    *((GRID, grid, "grid.csv: point: expected whole numbers from 1, each once") for grid in GRIDS),
    *((SAID, text, "provenance: expected recorded or simulated") for text in UNSAID),
    ("workspace/02/frames.csv", None, "frames.csv: file: expected a CSV table, found nothing"),
]


@pytest.mark.parametrize(("file", "text", "line"), WRONG)
def test_an_experiment_that_makes_no_sense(
    calibration, workspace, kinect, tmp_path, file, text, line
):
    """Rows of a table stand below its names."""
    path = tmp_path / file
    if text is None:
        path.unlink()
    else:
        names = path.read_text().splitlines(keepends=True)[0] if path.suffix == ".csv" else ""
        path.write_text(names + text)
    (found,) = check_experiment(tmp_path / file.partition("/")[0], kinect)
    assert line in found


def test_too_few_pairs_and_one_of_another_size(calibration, kinect):
    table = pd.read_csv(calibration / "frames.csv")
    table.iloc[:5].to_csv(calibration / "frames.csv", index=False)
    write_image(calibration / "infrared/000002.png", np.zeros((240, 320), np.uint8), "mono8")
    few, size = check_experiment(calibration, kinect)
    assert few.endswith("frames.csv: rows: expected at least 6, found 5")
    assert size.endswith("000002.png: infrared: expected 640 x 480 pixels, found 320 x 240")


def test_a_stereo_heads_cameras_are_left_and_right(calibration, root):
    sensor = yaml.safe_load((root / "tests/sample/sensors/bumblebee.yaml").read_text())
    sensor["color"] |= {"width_px": 640, "height_px": 480}
    (line,) = check_experiment(calibration, sensor)
    assert "columns: expected left, right, found frame" in line
    path = calibration / "frames.csv"
    path.write_text("frame,time_s,left,right\n" + path.read_text().split("\n", 1)[1])
    assert check_experiment(calibration, sensor) == []


def test_an_unknown_experiment(tmp_path, kinect):
    [line] = check_experiment(tmp_path / "juggling", kinect)
    known = "calibration, cd_case, hand_eye, load, loading, pivot, planes, stiffness, workspace"
    assert f"expected one of {known}" in line


def test_finds_captures_in_order_and_passes_over_the_rest(tmp_path):
    for folder in (
        "foam_block/kinect/11-a03",
        "foam_block/kinect/08",
        "foam_block/kinect/background",
        "foam_block/kinect/.part-09",
        "foam_block/.hidden/08",
        "foam_block/scans/08",
        "apple/bumblebee/01",
        "sensors/kinect/pivot",
        ".part-pear/kinect/01",
    ):
        (tmp_path / folder).mkdir(parents=True)
    for name in ("notes.txt", "foam_block/object.yaml", "foam_block/kinect/notes.txt"):
        (tmp_path / name).write_text("")
    assert discover(tmp_path) == [
        CaptureId("apple", "bumblebee", "01"),
        CaptureId("foam_block", "kinect", "08"),
        CaptureId("foam_block", "kinect", "11-a03"),
    ]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "left").mkdir()
    (tmp_path / "left/000000.png").write_bytes(b"image")
    (tmp_path / "force.csv").write_text("time_s\n")
    return tmp_path


@pytest.mark.parametrize(
    ("file", "changes"),
    [("left/000000.png", True), ("left/000001.png", True), (".snakemake_timestamp", False)],
)
def test_a_fingerprint_changes_with_visible_files(folder, file, changes):
    (folder / "left/itself.png").symlink_to("itself.png")
    before = folder_fingerprint(folder)
    (folder / file).write_bytes(b"another image")
    assert (folder_fingerprint(folder) != before) == changes


def test_links_that_lead_nowhere_or_round_do_not_count(folder):
    before = folder_fingerprint(folder, linked=2)
    for link, target in {"itself": "itself", "there": "back", "back": "there"}.items():
        (folder / link).symlink_to(target)
    assert folder_fingerprint(folder, linked=2) == before
    nothing = folder_fingerprint(folder / "none")
    assert {folder_fingerprint(folder / "itself", linked=n) for n in (0, 2)} == {nothing}
    assert stamp(folder / "itself") == ""
    (folder / "left/above").symlink_to("..")
    assert folder_fingerprint(folder, linked=2) != before  # entered as far as links may lead


@pytest.mark.parametrize("place", ["kinect", "kinect/08"])
def test_an_objects_sensor_or_capture_may_be_a_link(folder, place):
    """On another disk: what lies there counts, and a link to a link ends."""
    link = folder / "raw/sponge" / place
    link.parent.mkdir(parents=True)
    link.symlink_to(folder / "left")
    (folder / "left/round").symlink_to(folder / "left")
    before = folder_fingerprint(folder / "raw/sponge", linked=2)
    (folder / "left/000000.png").write_bytes(b"another image")
    assert folder_fingerprint(folder / "raw/sponge", linked=2) != before
