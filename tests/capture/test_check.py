"""The checker: nothing wrong with the sample, and one line for each thing that people get wrong."""

import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.__main__ import main
from palpate.capture.check import check_object
from palpate.capture.files import whole_file, whole_folder
from palpate.capture.images import write_image

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


def bare_point(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text().replace("'01':", "01:"))


def flat_normal(folder):
    path = folder / "object.yaml"
    spec = yaml.safe_load(path.read_text())
    spec["support"]["plane_normal"] = [0, 0, 0]
    path.write_text(yaml.safe_dump(spec))


def endless_tolerance(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text().replace("tolerance_m: 0.001", "tolerance_m: .nan"))


def another_template(folder):
    (folder / "template.ply").write_text("solid block\n")


def unruly_name(folder):
    (folder / "kinect/08").rename(folder / "kinect/08-b")


def short_background(folder):
    change_csv(folder / "kinect/background/frames.csv", lambda t: t.iloc[:3])


def few_frames(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.iloc[:2])


def no_frames(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.iloc[:0])


def frame_twice(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((3, "frame"), 2))


def broken_frame(folder):
    change_csv(
        folder / KINECT / "frames.csv", lambda t: t.assign(frame=t["frame"] + 0.5 * (t.index == 1))
    )


def blank_image(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((2, "color"), None))


def few_forces(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.iloc[:5])


def lose_gauge(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.drop(columns="v3"))


def word_in_force(folder):
    change_csv(
        folder / KINECT / "force.csv",
        lambda t: t.astype(object).where(~((t.index == 2)[:, None] & (t.columns == "v1")), "abc"),
    )


def small_image(folder):
    write_image(folder / KINECT / "color/000001.png", np.zeros((48, 64), np.uint8), "mono8")


def shallow_image(folder):
    write_image(folder / KINECT / "depth/000001.png", np.zeros((480, 640), np.uint8), "mono8")


def repeat_image(folder):
    images = folder / KINECT / "color"
    shutil.copy(images / "000004.png", images / "000005.png")


def name_image_twice(folder):
    change_csv(
        folder / KINECT / "frames.csv",
        lambda t: t.loc.__setitem__((5, "depth"), "depth/000004.png"),
    )


def name_an_endless_file(folder):
    change_csv(
        folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((2, "color"), "x" * 5000)
    )


def link_image_to_itself(folder):
    path = folder / KINECT / "color/000002.png"
    path.unlink()
    path.symlink_to(path.name)


def link_image_elsewhere(folder):
    path = folder / KINECT / "color/000002.png"
    path.unlink()
    path.symlink_to("/etc/hostname")


def name_two_lines(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((2, "color"), "a\nb"))


def template_of_another_kind(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text().replace("template.ply", "template.glb"))


def tiny_normal(folder):
    path = folder / "object.yaml"
    spec = yaml.safe_load(path.read_text())
    spec["points"]["08"]["direction"] = [0, 0, -1e-320]
    path.write_text(yaml.safe_dump(spec))


def point_in_millimetres(folder):
    path = folder / "object.yaml"
    spec = yaml.safe_load(path.read_text())
    spec["points"]["08"]["position_m"] = [-0.05, 0.0, 47.5]
    path.write_text(yaml.safe_dump(spec))


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
        (another_template, ["template.ply: template: expected a PLY mesh"]),
        (bare_point, ["object.yaml: points.1: expected a key in quotes, found the bare 1"]),
        (flat_normal, ["support.plane_normal: expected a direction, found zeros"]),
        (endless_tolerance, ["support.tolerance_m: expected a finite number, found nan"]),
        (unruly_name, ["kinect/08-b: capture: expected a name like 08 or 08-a03"]),
        (short_background, ["background/frames.csv: rows: expected at least 4, found 3"]),
        (few_frames, ["frames.csv: rows: expected at least 3, found 2"]),
        (no_frames, ["frames.csv: rows: expected at least 3, found 0"]),
        (frame_twice, ["frames.csv: frame: expected increasing", "found 2 then 2 in data row 4"]),
        (broken_frame, ["frames.csv: frame: expected whole numbers, found 1.5 in data row 2"]),
        (blank_image, ["frames.csv: color: expected a file, found nothing in data row 3"]),
        (few_forces, ["force.csv: rows: expected at least 10, found 5"]),
        (lose_gauge, ["force.csv: columns: expected time_s and v0..v5 or fx_n..tz_nm"]),
        (word_in_force, ["force.csv: v1: expected finite numbers, found abc in data row 3"]),
        (small_image, ["color/000001.png", "expected 640 x 480 pixels, found 64 x 48"]),
        (repeat_image, ["frames.csv: color: expected another image in each frame, found color/0"]),
        (name_image_twice, ["frames.csv: depth: expected another image", "the same as depth/0"]),
        (name_an_endless_file, ["color: expected an image, found a name that no file can have"]),
        (link_image_to_itself, ["color: expected an image, found a name that no file can have"]),
        (link_image_elsewhere, ["color: expected files of this folder, found color/000002.png"]),
        (name_two_lines, ["a\\nb: color: expected an image, found nothing"]),
        (template_of_another_kind, ["template.file: expected a file .ply", "found template.glb"]),
        (tiny_normal, ["points.08.direction: expected a direction, found [0, 0, -1e-320]"]),
        (point_in_millimetres, ["points.08.position_m.2: expected a number <= 10, found 47.5"]),
        (shallow_image, ["depth/000001.png", "expected 16-bit kinect_disparity, found 8 bits"]),
    ],
)
def test_one_clear_line(block, specifications, spoil, words):
    spoil(block)
    problems = check_object(block, *specifications)
    assert len(problems) == 1
    assert "\n" not in problems[0]
    for word in words:
        assert word in problems[0]


@pytest.mark.parametrize("name", ["lab", "Tables", "logs"])
def test_names_that_results_use(block, specifications, name):
    path = block / "object.yaml"
    path.write_text(path.read_text().replace("object: foam_block", f"object: {name}"))
    problems = check_object(block.rename(block.with_name(name)), *specifications)
    assert len(problems) == 1
    assert "object.yaml: object: expected none of benchmarks, figures, lab" in problems[0]


def test_all_problems_at_once(block, specifications):
    truncate_image(block)
    spoil_force(block)
    assert len(check_object(block, *specifications)) == 2


def test_clock_since_1970(block, specifications):
    for name in ("frames.csv", "force.csv"):
        change_csv(block / KINECT / name, lambda t: t.assign(time_s=t["time_s"] + 1712345678))
    assert check_object(block, *specifications) == []
    change_csv(block / KINECT / "frames.csv", lambda t: t.iloc[::-1].assign(frame=range(len(t))))
    (problem,) = [p for p in check_object(block, *specifications) if "increasing" in p]
    assert "found 1712345681.000000 then 1712345680.666667 in data row 2" in problem


def test_volts_need_a_calibration(block, specifications):
    sensors, probes = specifications
    bare = {name: {k: v for k, v in p.items() if k != "gauge"} for name, p in probes.items()}
    (problem,) = check_object(block, sensors, bare)
    assert "force.csv: columns: expected fx_n..tz_nm" in problem
    change_csv(
        block / KINECT / "force.csv",
        lambda t: t.set_axis(["time_s", "fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm"], axis=1),
    )
    assert check_object(block, sensors, bare) == []


def test_object_is_named_by_its_folder_from_within(block, specifications, monkeypatch):
    monkeypatch.chdir(block)
    assert check_object(".", *specifications) == []


def test_command_line_holds_the_sensors_to_their_schema(block, root, tmp_path, capsys):
    folder = shutil.copytree(root / "tests/sample/sensors", tmp_path / "sensors")
    path = folder / "kinect.yaml"
    path.write_text(path.read_text().replace("kind: structured_light", "kind: sonar"))
    probes = ["--probes", str(root / "config/probes")]
    assert main(["check", str(block), "--sensors", str(folder), *probes]) == 1
    assert "kinect.yaml: kind: expected one of depth, stereo" in capsys.readouterr().out
    assert main(["check", str(block), "--sensors", str(tmp_path / "none"), *probes]) == 1
    assert "none: folder: expected a sensor file" in capsys.readouterr().out


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


def test_folder_stands_when_it_is_complete(tmp_path):
    with whole_folder(tmp_path / "b") as part:
        (part / "c").write_text("whole")
        assert part.name.startswith(".")
        assert not (tmp_path / "b").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["b"]
    assert (tmp_path / "b/c").read_text() == "whole"
