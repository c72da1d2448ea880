"""The checker: nothing wrong with the sample, and one line for each thing that people get wrong."""

import shutil

import pytest
import spoils
import yaml
from palpate.__main__ import main
from palpate.capture.check import check_object
from palpate.capture.devices import read_device


def test_sample_is_right(root, specifications):
    assert check_object(root / "tests/sample/raw/foam_block", *specifications) == []


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (spoils.drop_force, ["force.csv", "found nothing"]),
        (spoils.truncate_image, ["color/000003.png", "truncated"]),
        (spoils.turn_time_back, ["frames.csv: time_s: expected increasing", "data row 5"]),
        (spoils.turn_force_time_back, ["force.csv: time_s: expected increasing"]),
        (spoils.spoil_force, ["force.csv: v2: expected finite numbers, found nan in data row 8"]),
        (spoils.endless_force, ["force.csv: v2: expected finite numbers, found inf in data row 8"]),
        (spoils.rename_sensor, ["sensor: expected one of bumblebee, kinect, found kinnect"]),
        (spoils.rename_point, ["point: expected one of 01", "found 99"]),
        (spoils.lose_background, ["background: folder: expected background frames"]),
        (spoils.lose_image, ["depth/000002.png", "expected an image, found nothing"]),
        (
            spoils.leave_folder,
            ["color: expected files of this folder, found ../../../../secret.png"],
        ),
        (spoils.lose_column, ["frames.csv: columns: expected depth"]),
        (spoils.cut_force, ["force.csv: time_s: expected a record that covers"]),
        (spoils.unknown_probe, ["object.yaml: probe: expected one of nano25_sphere, found needle"]),
        (spoils.unknown_field, ["object.yaml: colour: expected one of"]),
        (spoils.lose_object, ["object.yaml: file: expected YAML, found nothing"]),
        (spoils.lose_template, ["template.ply: template: expected a closed surface"]),
        (spoils.another_template, ["template.ply: template: expected a PLY mesh"]),
        (spoils.bare_point, ["object.yaml: points.1: expected a key in quotes, found the bare 1"]),
        (spoils.flat_normal, ["support.plane_normal: expected a direction, found zeros"]),
        (spoils.endless_tolerance, ["support.tolerance_m: expected a finite number, found nan"]),
        (spoils.unruly_name, ["kinect/08-b: capture: expected a name like 08 or 08-a03"]),
        (spoils.short_background, ["background/frames.csv: rows: expected at least 4, found 3"]),
        (spoils.few_frames, ["frames.csv: rows: expected at least 3, found 2"]),
        (spoils.no_frames, ["frames.csv: rows: expected at least 3, found 0"]),
        (
            spoils.frame_twice,
            ["frames.csv: frame: expected increasing", "found 2 then 2 in data row 4"],
        ),
        (
            spoils.broken_frame,
            ["frames.csv: frame: expected whole numbers, found 1.5 in data row 2"],
        ),
        (spoils.blank_image, ["frames.csv: color: expected a file, found nothing in data row 3"]),
        (spoils.few_forces, ["force.csv: rows: expected at least 10, found 5"]),
        (spoils.lose_gauge, ["force.csv: columns: expected time_s and v0..v5 or fx_n..tz_nm"]),
        (spoils.word_in_force, ["force.csv: v1: expected finite numbers, found abc in data row 3"]),
        (spoils.small_image, ["color/000001.png", "expected 640 x 480 pixels, found 64 x 48"]),
        (
            spoils.repeat_image,
            ["frames.csv: color: expected another image in each frame, found color/0"],
        ),
        (
            spoils.name_image_twice,
            ["frames.csv: depth: expected another image", "the same as depth/0"],
        ),
        (
            spoils.name_an_endless_file,
            ["color: expected an image, found a name that no file can have"],
        ),
        (
            spoils.link_image_to_itself,
            ["color: expected an image, found a name that no file can have"],
        ),
        (
            spoils.link_image_elsewhere,
            ["color: expected files of this folder, found color/000002.png"],
        ),
        (spoils.name_two_lines, ["a\\nb: color: expected an image, found nothing"]),
        (
            spoils.template_of_another_kind,
            ["template.file: expected a file .ply", "found template.glb"],
        ),
        (
            spoils.tiny_normal,
            ["points.08.direction: expected a direction, found [0.0, 0.0, -1e-320]"],
        ),
        (
            spoils.point_in_millimetres,
            ["points.08.position_m.2: expected a number <= 10, found 47.5"],
        ),
        (
            spoils.units_under_the_header,
            ["force.csv: rows: expected numbers, found s, V, V, V, V, V, V in data row 1 (units?"],
        ),
        (spoils.times_of_day, ["time_s: expected finite numbers, found 19:34:", "seconds are exp"]),
        (
            spoils.shallow_image,
            ["depth/000001.png", "expected 16-bit kinect_disparity, found 8 bits"],
        ),
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


def test_names_are_kept_wherever_one_comes_in(block, specifications, root, tmp_path):
    path = block / "object.yaml"
    path.write_text(path.read_text().replace("object: foam_block", "object: simulations"))
    (line,) = check_object(block.rename(block.with_name("simulations")), *specifications)
    assert "object: expected a name of letters, digits and _ other than sensors and sim" in line
    text = (root / "tests/sample/sensors/kinect.yaml").read_text()
    (tmp_path / "curve.yaml").write_text(text.replace("sensor: kinect", "sensor: curve"))
    _, (line,) = read_device(tmp_path / "curve.yaml", "sensors")
    assert "curve.yaml: sensor: expected a name of small letters, digits and _ other than" in line


def test_no_point_is_called_as_the_empty_scene(block, specifications):
    path = block / "object.yaml"
    spec = yaml.safe_load(path.read_text())
    spec["points"]["background"] = spec["points"]["08"]
    path.write_text(yaml.safe_dump(spec))
    (line,) = check_object(block, *specifications)
    assert "points.background: expected another name than that of the empty scene's" in line


def test_all_problems_at_once(block, specifications):
    spoils.truncate_image(block)
    spoils.spoil_force(block)
    assert len(check_object(block, *specifications)) == 2


def test_clock_since_1970(block, specifications):
    for name in ("frames.csv", "force.csv"):
        spoils.change_csv(
            block / spoils.KINECT / name, lambda t: t.assign(time_s=t["time_s"] + 1712345678)
        )
    assert check_object(block, *specifications) == []
    spoils.change_csv(
        block / spoils.KINECT / "frames.csv", lambda t: t.iloc[::-1].assign(frame=range(len(t)))
    )
    (problem,) = [p for p in check_object(block, *specifications) if "increasing" in p]
    assert "found 1712345681.000000 then 1712345680.666667 in data row 2" in problem


def test_volts_need_a_calibration(block, specifications):
    sensors, probes = specifications
    bare = {name: {k: v for k, v in p.items() if k != "gauge"} for name, p in probes.items()}
    (problem,) = check_object(block, sensors, bare)
    assert "force.csv: columns: expected fx_n..tz_nm" in problem
    spoils.change_csv(
        block / spoils.KINECT / "force.csv",
        lambda t: t.set_axis(["time_s", "fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm"], axis=1),
    )
    assert check_object(block, sensors, bare) == []


def test_object_is_named_by_its_folder_from_within(block, specifications, monkeypatch):
    monkeypatch.chdir(block)
    assert check_object(".", *specifications) == []


def test_command_line_names_what_is_wrong_with_sensors(block, root, tmp_path, capsys):
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
    spoils.drop_force(block)
    assert main(["check", str(block), *options]) == 1
    assert "force.csv" in capsys.readouterr().out


def test_a_recording_under_two_names_is_one(block, specifications):
    shutil.copytree(block / "kinect/08", block / "kinect/08-a02")
    (line,) = check_object(block, *specifications)
    assert line.startswith(f"{block}/kinect/08-a02/force.csv: content: expected another recording")
    assert line.endswith("found that of 08")
