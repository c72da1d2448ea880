"""The checker: nothing wrong with the sample, and one line for each thing that people get wrong."""

import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.__main__ import main
from palpate.capture.check import check_object
from palpate.capture.files import whole_file, whole_folder

KINECT = "kinect/08"


@pytest.fixture(scope="session")
def specifications(root):
    def named(folder):
        return {path.stem: yaml.safe_load(path.read_text()) for path in folder.glob("*.yaml")}

    return named(root / "tests/sample/sensors"), named(root / "config/probes")


@pytest.fixture
def block(root, tmp_path):
    """The sample's block with the Kinect's capture alone."""
    folder = tmp_path / "foam_block"
    source = root / "tests/sample/raw/foam_block"
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns("bumblebee"))
    return folder


def change_csv(path, change):
    table = pd.read_csv(path)
    changed = change(table)
    (table if changed is None else changed).to_csv(path, index=False)


def test_sample_is_right(root, specifications):
    assert check_object(root / "tests/sample/raw/foam_block", *specifications) == []


def drop_force(folder):
    (folder / KINECT / "force.csv").unlink()


def truncate_image(folder):
    path = folder / KINECT / "color/000003.png"
    path.write_bytes(path.read_bytes()[:1000])


def turn_time_back(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((4, "time_s"), 0.0))


def turn_force_time_back(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.loc.__setitem__((40, "time_s"), -9.0))


def spoil_force(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.loc.__setitem__((7, "v2"), np.nan))


def endless_force(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.loc.__setitem__((7, "v2"), np.inf))


def rename_sensor(folder):
    (folder / "kinect").rename(folder / "kinnect")


def rename_point(folder):
    (folder / "kinect/08").rename(folder / "kinect/99")


def lose_background(folder):
    shutil.rmtree(folder / "kinect/background")


def lose_image(folder):
    (folder / KINECT / "depth/000002.png").unlink()


def leave_folder(folder):
    change_csv(
        folder / KINECT / "frames.csv",
        lambda t: t.loc.__setitem__((2, "color"), "../../../../secret.png"),
    )


def lose_column(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.drop(columns="depth"))


def cut_force(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.iloc[:200])


def unknown_probe(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text().replace("nano25_sphere", "needle"))


def unknown_field(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text() + "colour: red\n")


def lose_object(folder):
    (folder / "object.yaml").unlink()


def lose_template(folder):
    (folder / "template.ply").unlink()


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (drop_force, ["force.csv", "found nothing"]),
        (truncate_image, ["color/000003.png", "truncated"]),
        (turn_time_back, ["frames.csv: time_s: expected increasing", "data row 5"]),
        (turn_force_time_back, ["force.csv: time_s: expected increasing"]),
        (spoil_force, ["force.csv: v2: expected finite numbers, found nan in data row 8"]),
        (endless_force, ["force.csv: v2: expected finite numbers, found inf in data row 8"]),
        (rename_sensor, ["sensor: expected one of bumblebee, kinect, found kinnect"]),
        (rename_point, ["point: expected one of 01", "found 99"]),
        (lose_background, ["background: folder: expected background frames"]),
        (lose_image, ["depth/000002.png", "expected an image, found nothing"]),
        (leave_folder, ["color: expected files of this folder, found ../../../../secret.png"]),
        (lose_column, ["frames.csv: columns: expected depth"]),
        (cut_force, ["force.csv: time_s: expected a record that covers"]),
        (unknown_probe, ["object.yaml: probe: expected one of nano25_sphere, found needle"]),
        (unknown_field, ["object.yaml: colour: expected one of"]),
        (lose_object, ["object.yaml: file: expected YAML, found nothing"]),
        (lose_template, ["template.ply: template: expected a closed surface"]),
    ],
)
def test_one_clear_line(block, specifications, spoil, words):
    spoil(block)
    problems = check_object(block, *specifications)
    assert len(problems) == 1
    assert "\n" not in problems[0]
    for word in words:
        assert word in problems[0]


def test_all_problems_at_once(block, specifications):
    truncate_image(block)
    spoil_force(block)
    assert len(check_object(block, *specifications)) == 2


def test_command_line(block, root, capsys):
    options = [
        "--sensors",
        str(root / "tests/sample/sensors"),
        "--probes",
        str(root / "config/probes"),
    ]
    assert main(["check", str(block), *options]) == 0
    assert "kinect/08: 10 frames over 3.00 s" in capsys.readouterr().out
    drop_force(block)
    assert main(["check", str(block), *options]) == 1
    assert "force.csv" in capsys.readouterr().out


def test_files_are_whole_or_absent(tmp_path):
    with pytest.raises(RuntimeError), whole_file(tmp_path / "a.csv") as part:
        part.write_text("half")
        raise RuntimeError
    with pytest.raises(RuntimeError), whole_folder(tmp_path / "b") as part:
        (part / "c").write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []
