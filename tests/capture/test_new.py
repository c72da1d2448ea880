"""A new object: what is written and left to fill in, its check; examples of the help run."""

import re
import shlex
import shutil

import numpy as np
import pytest
import yaml
from import_help import mcap_file, ros1, tum
from instruments import PLAIN
from palpate import open_capture
from palpate.__main__ import main
from palpate.config.model import FILL_IN
from palpate.config.probe import ProbeSpec
from palpate.config.sensor import SensorSpec
from palpate.yaml_files import load_yaml

# A real file of each kind of camera.
KINDS = {
    "depth": "tests/own_object/sensors/bench_cam.yaml",
    "structured_light": "config/sensors/kinect.yaml",
    "stereo": "config/sensors/bumblebee.yaml",
}
LEFT = re.compile(r"(\S+): (\S+): expected (.+), found nothing filled in yet")
NAMES = ["--sensor", "bench_cam", "--probe", "bench_probe"]


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """An empty folder, in which commands are given."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files(folder):
    return {path: path.read_text() for path in folder.rglob("*") if path.is_file()}


def filled(blank, real):
    """A file's content with each value to fill in taken from another's, and the rest as it is."""
    if isinstance(blank, dict):
        return {key: filled(value, real[key]) for key, value in blank.items()}
    if isinstance(blank, list):
        return [filled(*pair) for pair in zip(blank, real, strict=True)]
    return real if blank == FILL_IN else blank


def fill_in(path, real):
    spec = filled(yaml.safe_load(path.read_text()), real)
    path.write_text(yaml.safe_dump(spec))
    return spec


def replace_in(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def lines_left(said, folder):
    """Files and fields that a check says are left, and its other lines."""
    lines = said("check", folder, status=1).splitlines()
    left = [LEFT.fullmatch(line) for line in lines]
    other = [line for line, match in zip(lines, left, strict=True) if not match]
    return [match.groups()[:2] for match in left if match], other


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_left_is_told_and_nothing_else_and_filled_in_it_is_right(lab, root, kind, said):
    told = said("new", "sponge", "--sensor", "eye", "--kind", kind)
    counts = re.findall(r"(\S+): written, (\d+) fields to fill in", told)
    left, other = lines_left(said, "raw/sponge")
    assert {(path, str(sum(place == path for place, _ in left))) for path, _ in left} == set(counts)
    fields = [field for path, field in left if path == "config/probes/probe.yaml"]
    assert fields == ["indenter.radius_m", "marker.inner_corners", "marker.square_m",
        "marker_from_force", "force_from_tip", "exclusion.radius_m", "exclusion.tip_radius_m",
        "exclusion.board_radius_m"]  # fmt: skip
    fields = [field for path, field in left if path == "raw/sponge/object.yaml"]
    assert fields == ["support.plane_point_m", "support.plane_normal", "points.01.position_m"]
    assert ("config/sensors/eye.yaml", "color.fx_px") in left
    disparities = ("config/sensors/eye.yaml", "depth.disparity_offset_px") in left
    assert disparities == (kind == "structured_light")
    assert ("stereo.baseline_m" in dict(map(reversed, left))) == (kind == "stereo")
    assert other == [
        "raw/sponge/template.ply: template: expected a closed surface, found nothing",
        "raw/sponge/eye/background: folder: expected background frames, found nothing",
    ]
    spec = fill_in(lab / "config/sensors/eye.yaml", load_yaml(root / KINDS[kind]))
    assert (spec["sensor"], spec["kind"]) == ("eye", kind)
    SensorSpec.read(spec)


def test_what_may_be_left_out_fits_when_it_is_put_in(lab, root):
    """The fields behind a # without it, and filled in."""
    assert main(["new", "sponge"]) == 0
    path = lab / "config/probes/probe.yaml"
    text = path.read_text()
    start = text.index("# # between target and ball")
    path.write_text(text[:start] + re.sub("^# ", "", text[start:], flags=re.MULTILINE))
    probe = load_yaml(root / "config/probes/nano25_sphere.yaml") | {"stiffness_n_m": 2e4}
    spec = fill_in(path, probe)
    assert {"stiffness_n_m", "load", "gauge"} <= set(spec)
    ProbeSpec.read(spec)


@pytest.mark.parametrize(
    ("board", "fields", "printed"),
    [
        ("charuco", "squares square_m tag_m dictionary", "--squares 7x5 --square-mm 15"),
        ("aprilgrid", "tags tag_m gap_m dictionary", "--tags 6x5 --tag-mm 12 --gap-mm 3"),
    ],
)
def test_a_board_with_tags(lab, said, board, fields, printed):
    said("new", "sponge", "--board", board)
    path = lab / "config/probes/probe.yaml"
    assert list(load_yaml(path)["marker"]) == ["kind", *fields.split()]
    block = yaml.safe_load(said("board", board, *printed.split(), "--output", lab / "board.pdf"))
    real = {"probe": "probe", "indenter": {"shape": "sphere", "radius_m": 0.006}} | block
    real |= {key: np.eye(4).tolist() for key in ("marker_from_force", "force_from_tip")}
    real["exclusion"] = {"radius_m": 0.035, "tip_radius_m": 0.0085, "board_radius_m": 0.09}
    ProbeSpec.read(fill_in(path, real))


def test_a_probe_without_a_board(lab, said):
    said("new", "sponge", "--board", "none")
    files = [lab / f"config/{name}.yaml" for name in ("sensors/camera", "probes/probe")]
    sensor, probe = map(load_yaml, files)
    assert "marker" not in {*sensor, *probe} and "board_radius_m" not in probe["exclusion"]
    left = [field for _, field in lines_left(said, "raw/sponge")[0]]
    assert {"base.camera_from_base", "tracked", "marker_from_force"} <= set(left)


@pytest.fixture
def cow(lab, root):
    """The own object begun anew under its names, with its numbers filled in, and its captures."""
    assert main(["new", "toy_cow", *NAMES]) == 0
    own = root / "tests/own_object"
    path = lab / "config/sensors/bench_cam.yaml"
    fill_in(path, load_yaml(own / "sensors/bench_cam.yaml"))
    fill_in(lab / "config/probes/bench_probe.yaml", load_yaml(own / "probes/bench_probe.yaml"))
    path = lab / "raw/toy_cow/object.yaml"
    replace_in(path, '"01":', '"back":')
    fill_in(path, load_yaml(own / "raw/toy_cow/object.yaml"))
    shutil.copy(own / "raw/toy_cow/template.ply", path.parent)
    captures = lab / "raw/toy_cow/bench_cam"
    shutil.copytree(own / "raw/toy_cow/bench_cam", captures, dirs_exist_ok=True)
    return path.parent


@pytest.mark.parametrize("sensors", ["cameras", "elsewhere/cameras", "config/sensors"])
def test_objects_are_beside_the_configuration_wherever_sensors_are(lab, sensors, monkeypatch, said):
    (lab / "elsewhere").mkdir()
    (lab / sensors).mkdir(parents=True)
    (lab / "config").mkdir(exist_ok=True)
    (lab / "config/config.yaml").write_text(f"paths: {{sensors: {sensors}}}\n")
    for folder, raw in (("", "raw"), ("elsewhere", "../raw")):
        monkeypatch.chdir(lab / folder)
        assert said("check", status=1).startswith(f"{raw}: folder: expected objects")


@pytest.mark.long
def test_an_own_objects_devices_are_found_from_other_folders(cow, lab, monkeypatch, said):
    (lab / "elsewhere").mkdir()
    monkeypatch.chdir(lab / "raw")
    assert "of ../config/sensors and ../config/probes" in said("check", "toy_cow")
    assert open_capture("toy_cow/bench_cam/back").radius_m == 0.006
    monkeypatch.chdir(lab / "elsewhere")
    assert open_capture(cow / "bench_cam/back").radius_m == 0.006
    assert "../raw/toy_cow: nothing wrong" in said("check")
    # Where the configuration says.
    (lab / "config/sensors").rename(lab / "elsewhere/cameras")
    (lab / "config/config.yaml").write_text("paths: {sensors: elsewhere/cameras}\n")
    said("check", "../raw/toy_cow")


def test_a_recording_that_a_run_will_miss(cow, lab, said):
    told = said("check", "raw/toy_cow")
    assert "raw/toy_cow: nothing wrong" in told and "sensors and probes" not in told
    path = lab / "config/probes/bench_probe.yaml"
    path.write_text(path.read_text() + "\ntip: calibration\n")
    place = "raw/sensors/bench_cam/pivot"
    expected = f"expected a recording of the turning handle in {place}, found none"
    told = said("check", "raw/toy_cow", status=1)
    assert told.splitlines()[0] == f"config/probes/bench_probe.yaml: tip: {expected}"
    (lab / place).mkdir(parents=True)
    said("check", "raw/toy_cow")
    (lab / "config/config.yaml").write_text("experiments: {probe: stick}\n")
    expected = "expected a recording of bench_probe (experiments.probe, in config/config.yaml)"
    line = f"bench_probe.yaml: tip: {expected}, found one of stick"
    assert line in said("check", "raw/toy_cow", status=1)
    (lab / "config/config.yaml").write_text("experiments: {probe: bench_probe}\n")
    said("check", "raw/toy_cow")
    shutil.rmtree(cow / "bench_cam")
    assert "nothing wrong, and no capture yet" in said("check", "raw/toy_cow")


@pytest.mark.long
def test_files_of_others_do_not_hold_up_an_object(cow, said):
    said("new", "sponge", "--sensor", "eye")
    lines = said("check", "raw/toy_cow").splitlines()
    assert lines[0] == "raw/toy_cow: nothing wrong"
    probe, eye = lines[-2:]
    assert probe.startswith("worth a look: config/probes/probe.yaml: indenter.radius_m: expected")
    assert probe.endswith("and 7 more (not used here)")
    assert eye.startswith("worth a look: config/sensors/eye.yaml: frame_rate_hz: expected")
    assert "worth a look" not in said("check", "raw/toy_cow", "raw/sponge", status=1)


CAMERA, PROBE = "sensors/bench_cam", "probes/bench_probe"


@pytest.mark.parametrize(
    ("folder", "old", "new", "words"),
    [
        (CAMERA, "kind: depth", "kind: sonar", "kind: expected one of cloud, depth, stereo"),
        (PROBE, "radius_m: 0.006", "radius_m: 0.06", "exclusion.radius_m: expected"),
        (PROBE, "probe: bench_probe", "probe: another", "expected bench_probe"),
    ],
)
def test_a_wrong_file_is_told_of_the_objects_that_use_it(cow, lab, folder, old, new, words, said):
    replace_in(lab / f"config/{folder}.yaml", old, new)
    line = said("check", "raw/toy_cow", status=1).splitlines()[0]
    assert line.startswith(f"config/{folder}.yaml: ") and words in line


def test_without_sensors_and_probes_a_check_says_where_it_looked(lab, said):
    (lab / "raw/sponge").mkdir(parents=True)
    lines = said("check", "raw/sponge", status=1).splitlines()
    assert [line.partition(":")[0] for line in lines] == ["config/sensors", "config/probes"]
    assert f"{lab}/raw/sponge, in {lab} and above them" in lines[0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["My Cow"], "object: expected a name of letters, digits and _ other than sensors"),
        (["../sponge"], "object: expected a name of letters, digits and _"),
        (["Tables"], "object: expected none of benchmarks, figures, lab"),
        (["sponge", "--sensor", "scans"], "sensor: expected a name of small letters"),
        (["sponge", "--probe", "../nano"], "probe: expected a name of small letters"),
    ],
)
def test_names_are_rejected_before_anything_is_written(lab, said, arguments, words):
    (line,) = said("new", *arguments, status=1).splitlines()
    assert words in line and not list(lab.iterdir())


def test_files_that_are_there_are_left_alone(lab, said):
    said("new", "sponge")
    before = files(lab)
    assert len(before) == 3
    (line,) = said("new", "sponge", status=1).splitlines()
    assert line.startswith("error: raw/sponge/object.yaml: file: expected none yet, found one")
    assert files(lab) == before
    told = said("new", "cushion")
    for path in ("config/sensors/camera.yaml", "config/probes/probe.yaml"):
        assert f"{path}: there already, and used as it is" in told
    assert {path: text for path, text in files(lab).items() if path in before} == before


def test_it_goes_where_the_project_is(lab, monkeypatch, said):
    for name in ("config/sensors", "config/probes", "raw"):
        (lab / name).mkdir(parents=True)
    monkeypatch.chdir(lab / "raw")
    assert "4. palpate check sponge\n" in said("new", "sponge")
    expected = ["config/probes/probe.yaml", "config/sensors/camera.yaml", "raw/sponge/object.yaml"]
    assert sorted(str(path.relative_to(lab)) for path in files(lab)) == expected


def test_an_import_fills_in_the_cameras_file(lab, film, said):
    said("new", "block", "--sensor", "eye")
    path = lab / "config/sensors/eye.yaml"
    line = "eye.yaml: color.width_px: expected the images' width"
    assert line in said("import", tum(lab / "tum", film), "raw/block/eye/01", status=1)
    replace_in(path, "range_m: [FILL_IN, FILL_IN]", "range_m: [0.3, 2.5]")
    told = said("import", mcap_file(lab, film), "raw/block/eye/01")
    assert "eye.yaml: written, from the recording's optics" in told
    spec = load_yaml(path)
    SensorSpec.read(spec)
    assert spec["range_m"] == [0.3, 2.5]
    assert spec["color"]["fx_px"] == film.color_optics[0]


def test_without_a_name_the_camera_is_the_one_that_is_there(lab, film, said):
    said("import", mcap_file(lab, film), "raw/block/eye/01")
    assert "config/sensors/eye.yaml: there already" in said("new", "block")
    assert [path.name for path in (lab / "raw/block").iterdir() if path.is_dir()] == ["eye"]


def sponge(root, folder, film):
    """The own object's captures under another name."""
    own = root / "tests/own_object"
    for name in ("sensors", "probes"):
        shutil.copytree(own / name, folder / "config" / name)
    shutil.copytree(own / "raw/toy_cow", folder / "raw/sponge")
    replace_in(folder / "raw/sponge/object.yaml", "object: toy_cow", "object: sponge")


def recording(root, folder, film):
    ros1(folder, film).rename(folder / "press.bag")


def curve(root, folder, film):
    (folder / "curve.csv").write_bytes(PLAIN.content())


# A new object needs nothing.
NEEDED = {"hertz": curve, "new": lambda *_: None, "import": recording, "check": sponge}


@pytest.mark.parametrize("verb", NEEDED)
def test_the_example_runs(verb, root, lab, film, capsys):
    with pytest.raises(SystemExit, match="0"):
        main([verb, "--help"])
    last = capsys.readouterr().out.rstrip().splitlines()[-1]
    example = re.fullmatch(rf"  palpate ({verb} .+)", last).group(1)
    NEEDED[verb](root, lab, film)
    assert main(shlex.split(example)) == 0
