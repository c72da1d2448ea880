"""The public names: each has an example, and it runs; a modulus and the verdicts on it."""

import doctest
import importlib
import inspect
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace

import palpate
import pandas as pd
import pytest
from capture.instruments import PLAIN
from palpate.__main__ import main
from palpate.modulus import Modulus, verdict_of_nu

MODULES = ("hertz", "direct", "noise", "plan")
FUNCTIONS = {
    "hertz": ("fit", "fit_shape", "read_curve", "HertzFit"),
    "direct": ("estimate",),
    "noise": ("measure",),
    "plan": ("Planned",),
}


def things():
    """Public names and what they are."""
    own = {name: getattr(palpate, name) for name in palpate.__all__ if name not in MODULES}
    own.pop("__version__")
    for name in MODULES:
        own |= {f"{name}.{one}": getattr(getattr(palpate, name), one) for one in FUNCTIONS[name]}
    return own


def examples():
    """Names with an example; those that press or track a solid take a quarter of a minute each."""
    long = {"direct.estimate", "hertz.fit_shape", "indentation_model", "indentation_table", "track"}
    long |= {"Measurement", "plan.Planned", "solid_of"}
    for name in sorted(set(things()) - {"hertz.HertzFit"}):
        yield pytest.param(name, marks=pytest.mark.long) if name in long else name


@pytest.mark.parametrize("name", list(examples()))
def test_its_example_runs(root, monkeypatch, name):
    monkeypatch.chdir(root)
    thing = things()[name]
    module = importlib.import_module(thing.__module__)
    finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner()
    (example,) = finder.find(thing, name, module=module, globs=dict(vars(module)))
    assert example.examples, "expected an example"
    told = []
    runner.run(example, out=told.append)
    assert not runner.summarize(verbose=False).failed, "".join(told)
    assert inspect.getdoc(thing)


# Each job begins with the first; nothing here uses what the second leaves out.
LIGHT = """
import sys, palpate
print(*(name for name in ("numpy", "cv2", "pandas") if name in sys.modules))
from palpate.open3d_core import UNUSED, o3d
o3d.t.geometry.RaycastingScene(nthreads=1)
print(*(name for name in (*UNUSED, "sklearn", "dash") if name in sys.modules))
import open3d
assert o3d is open3d
"""


def test_importing_it_loads_nothing_heavy(root):
    command, place = [sys.executable, "-c", LIGHT], root / "workflow/scripts"
    done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=True)
    assert done.stdout == "\n\n"


def test_the_command_ends_in_one_line(root, tmp_path, capsys):
    (tmp_path / "curve.csv").write_text("depth_m,way_m\n0,1\n1,2\n2,3\n")
    assert main(["hertz", str(tmp_path / "curve.csv"), "--radius-mm", "6"]) == 1
    line = capsys.readouterr().err
    assert line == (
        f"error: {tmp_path}/curve.csv: columns: expected one column of force, found depth_m, way_m"
        " (say --force-column NAME, or its number)\n"
    )
    assert main(["direct", str(tmp_path / "raw/cow/kinect/01")]) == 1
    assert "kinect/01: folder: expected a capture, or an object's" in capsys.readouterr().err


def test_what_does_not_fit_is_said(root, monkeypatch):
    monkeypatch.chdir(root)
    with pytest.raises(ValueError, match="^hertz.onset: expected .*onset_force_n.*found onset"):
        palpate.Config.read({"hertz": {"onset": 1}})
    with pytest.raises(ValueError, match="depth_m, force_n: expected a press, found no change"):
        palpate.hertz.fit([0.0, 0.0, 0.0], [0.0, 1.0, 2.0], radius_m=0.006)
    with pytest.raises(ValueError, match="measured: expected captures of one object and sensor"):
        palpate.direct.estimate([], [])
    capture = palpate.open_capture(
        "tests/sample/raw/foam_block/kinect/08", sensors="tests/sample/sensors"
    )
    asks = replace(capture, sensor=capture.sensor | {"optics": "calibration"})
    with pytest.raises(ValueError, match="optics: expected the calibration.json that kinect's"):
        palpate.measure(asks)
    asks = replace(capture, probe=capture.probe | {"tip": "calibration"})
    with pytest.raises(ValueError, match="tip: expected the tip.json that the file of nano25"):
        palpate.measure(asks)
    scans = replace(capture, declared=capture.declared | {"template": {"scans": "scans"}})
    with pytest.raises(ValueError, match="template.file: expected a mesh, found scans"):
        _ = scans.template


@pytest.fixture(scope="module")
def lab(root, tmp_path_factory):
    """A folder as a lab has it: configuration, devices, two presses of one point."""
    folder = tmp_path_factory.mktemp("lab")
    own = root / "tests/own_object"
    for name in ("sensors", "probes"):
        shutil.copytree(own / name, folder / "config" / name)
    (folder / "config/config.yaml").write_text("hertz: {onset_force_n: 0.08}\n")
    # As the help's example has it.
    shutil.copytree(own / "raw/toy_cow", folder / "raw/sponge")
    described = folder / "raw/sponge/object.yaml"
    described.write_text(described.read_text().replace("object: toy_cow", "object: sponge"))
    return folder


@pytest.mark.long
def test_the_command_finds_all_of_an_object_by_itself(lab, monkeypatch, capsys):
    """Captures, configuration and tables; a point's table is made once and kept, with a name."""
    monkeypatch.chdir(lab)
    with pytest.raises(SystemExit, match="0"):
        main(["direct", "--help"])
    example = capsys.readouterr().out.split()[-3:]
    assert example == ["palpate", "direct", "raw/sponge"]
    assert main([*example[1:], "--figure", str(lab / "direct.svg")]) == 0
    said = capsys.readouterr()
    steps = [line for line in said.err.splitlines() if line.startswith("[")]
    assert [line[:8] for line in steps] == [f"[{k} of 4]" for k in (1, 2, 3, 4)]
    assert re.search(r"kept in results/sponge/indentation-back-[0-9a-f]{8}.npz", steps[2])
    assert "skfem" not in said.err
    assert said.out.startswith("sponge, bench_cam: 2 captures\n  effective_reduced_modulus: ")
    assert (lab / "direct.svg").stat().st_size > 10_000
    # As sure as no film is: pictures tell nu better than to 0.02.
    given = ["direct", "raw/sponge/bench_cam/back", "--nu", "0.38", "--nu-std", "0.002"]
    assert main([*given, "--json", "--quiet"]) == 0
    said = capsys.readouterr()
    assert not said.err
    told = json.loads(said.out)
    ratio, E = told["poisson_ratio"], told["youngs_modulus_pa"]
    assert ratio["verdict"] == "assumed"
    assert (ratio["low"], ratio["high"]) == pytest.approx(
        (0.38 - 0.00392, 0.38 + 0.00392), abs=1e-4
    )
    # The lab's material: 38 kPa.
    assert E["low"] < 38e3 < E["high"]
    assert told["captures"] == ["raw/sponge/bench_cam/back"]
    assert told["options"]["poisson_ratio_std"] == 0.002
    assert "given Poisson's ratio" in {row["source"] for row in told["budget"]}


@pytest.mark.long
def test_a_table_of_another_object_is_refused(lab, root, monkeypatch, capsys):
    monkeypatch.chdir(root)
    capture = ["tests/sample/raw/foam_block/kinect/08", "--sensors", "tests/sample/sensors"]
    tables = lab / "results/sponge"
    (made,) = tables.glob("indentation-back-*.npz")
    (tables / "indentation-08.npz").symlink_to(made)
    assert main(["direct", *capture, "--tables", str(tables)]) == 1
    assert "error: tables: expected one" in capsys.readouterr().err


def test_a_recording_given_twice_is_refused(root, monkeypatch):
    """Under another name it would count twice, and the interval would be too narrow."""
    monkeypatch.chdir(root)
    folder = root / "tests/sample/raw/foam_block/kinect/08"
    one = palpate.measure(palpate.open_capture(folder, sensors="tests/sample/sensors"))
    again = replace(one, capture=replace(one.capture, folder=folder.with_name("08-a02")))
    with pytest.raises(ValueError, match="found 08-a02, the same recording as 08"):
        palpate.direct.estimate([one, again], [None, None])


WRONG = {
    ("raw",): "raw: folder: expected a capture, or an object's or a sensor's folder with captures",
    ("raw/sponge/nothing",): "nothing: folder: expected a capture, .*found no such folder",
    ("raw/sponge", "--config", "none.yaml"):
        "--config: expected a file, found nothing at none.yaml",
    ("raw/sponge", "--config", "mine.yaml"): "mine.yaml: herz: expected one of",
    ("raw/sponge", "--nu-std", "0.1"): "--nu-std: expected --nu beside it, found none",
    ("raw/sponge", "--tables", "none"): "--tables: expected a folder, found none at none .make it",
    ("raw/sponge", "--figure", "fit.bmp"): "--figure: expected a file that ends with one of .png",
}  # fmt: skip


@pytest.mark.parametrize("given", WRONG)
def test_what_is_no_capture_is_said_before_the_work(lab, given, monkeypatch, capsys):
    monkeypatch.chdir(lab)
    (lab / "mine.yaml").write_text("herz: {onset_force_n: 0.2}\n")
    assert main(["direct", *given]) == 1
    said = capsys.readouterr()
    assert not said.out
    assert re.fullmatch(f"error: .*{WRONG[given]}.*\n", said.err), said.err


def test_a_table_without_rows_is_said(lab, monkeypatch, capsys):
    monkeypatch.chdir(lab)
    frames = lab / "raw/sponge/bench_cam/back-a02/frames.csv"
    whole = frames.read_text()
    try:
        frames.write_text(whole.splitlines()[0] + "\n")
        assert main(["direct", "raw/sponge"]) == 1
    finally:
        frames.write_text(whole)
    assert "back-a02/frames.csv: rows: expected at least 3, found 0" in capsys.readouterr().err


def blocks_of(page):
    """Python blocks of a page, those of its captures apart from those of its curves."""
    curves, _, captures = page.partition("## Captures")
    return [re.findall(r"```python\n(.*?)```", text, re.DOTALL) for text in (curves, captures)]


@pytest.mark.parametrize("part", [0, pytest.param(1, marks=pytest.mark.long)])
def test_the_page_runs_as_it_stands(part, root, tmp_path, monkeypatch, capsys):
    (tmp_path / "curve.csv").write_bytes(PLAIN.content())
    for name in ("tests", "config"):
        (tmp_path / name).symlink_to(root / name)
    monkeypatch.chdir(tmp_path)
    blocks = blocks_of((root / "docs/api.md").read_text())[part]
    names = {"palpate": palpate}
    for block in blocks:
        exec(compile(block, "docs/api.md", "exec"), names)
    said = capsys.readouterr()
    assert "skfem" not in said.err
    if part == 0:
        assert "E* " in said.out and "reduced_modulus_pa" in names["found"].row()
    else:
        assert said.out.count("DirectEstimate of 1 capture") == 2


MODULUS = Modulus(24130.0, 23000.0, 25500.0, "identified", "Pa")


@pytest.mark.parametrize(
    ("modulus", "text"),
    [
        (MODULUS, "24.1 kPa (23.0 to 25.5), identified"),
        (Modulus(2.5e6, 1e5, 3e6, "bounded", "Pa"), "2.5 MPa (0.1 to 3.0), bounded"),
        (Modulus(0.312, 0.0, 0.49, "not identified", "1"), "0.31 (0.00 to 0.49), not identified"),
        (Modulus(850.0, None, None, "not judged", "Pa"), "850.0 Pa, not judged"),
    ],
)
def test_a_modulus_is_told_in_its_own_unit(modulus, text):
    assert str(modulus) == text


@pytest.mark.parametrize("name", ["youngs_modulus_pa", "poisson_ratio"])
def test_a_table_gives_back_what_it_was_given(name):
    unit = "Pa" if name.endswith("_pa") else "1"
    one = Modulus(0.4, 0.3, 0.5, "bounded", unit)
    table = pd.DataFrame([one.cells(name), {}])
    assert Modulus.of_row(table.iloc[0], name) == one
    assert Modulus.of_row(table.iloc[1], name) is None


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (0.0051, 0.2, "identified"),
        (0.005, 0.2, "bounded"),
        (0.3, 0.4949, "identified"),
        (0.3, 0.495, "bounded"),
        (0.25, 0.45, "identified"),
        (0.25, 0.4501, "bounded"),
        (0.005, 0.4949, "bounded"),
        (0.0051, 0.495, "bounded"),
        (0.005, 0.495, "not identified"),
    ],
)
def test_verdicts_of_poissons_ratio_at_their_limits(low, high, verdict):
    assert verdict_of_nu(low, high, (0.0, 0.5)) == verdict


def test_a_modulus_is_identified_up_to_a_factor():
    highs = (15.0, 15.001)
    found = [Modulus.of_pascals(12.0, 10.0, high).verdict for high in highs]
    assert found == ["identified", "bounded"]
