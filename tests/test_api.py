"""The public names: each has an example, and it runs."""

import doctest
import importlib
import inspect
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import palpate
import pytest

MODULES = ("hertz", "direct")
FUNCTIONS = {"hertz": ("fit", "read_curve", "HertzFit"), "direct": ("estimate",)}


def things():
    """Public names and what they are."""
    own = {name: getattr(palpate, name) for name in palpate.__all__ if name not in MODULES}
    own.pop("__version__")
    for name in MODULES:
        own |= {f"{name}.{one}": getattr(getattr(palpate, name), one) for one in FUNCTIONS[name]}
    return own


def test_there_are_about_twenty():
    assert 15 <= len(things()) <= 25
    assert set(palpate.__all__) <= set(dir(palpate))
    with pytest.raises(AttributeError, match="has no attribute 'stiffness'"):
        _ = palpate.stiffness


def examples():
    """Names with an example; those that press or track a solid take a quarter of a minute each."""
    long = {"direct.estimate", "indentation_table", "track"}
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


def test_importing_it_loads_nothing_heavy(root):
    """Each job begins with it."""
    code = "import palpate, sys; print([m for m in ('numpy', 'cv2', 'pandas') if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=root / "workflow/scripts",
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "[]\n"


def test_the_page_names_them_all(root):
    text = (root / "docs/api.md").read_text()
    names = [name for name in things() if f"`{name}`" not in text]
    assert names == []


def test_the_command_ends_in_one_line(root, tmp_path, capsys):
    from palpate.__main__ import main

    (tmp_path / "curve.csv").write_text("depth_m,way_m\n0,1\n1,2\n2,3\n")
    assert main(["hertz", str(tmp_path / "curve.csv"), "--radius-mm", "6"]) == 1
    line = capsys.readouterr().err
    assert line == (
        f"error: {tmp_path}/curve.csv: columns: expected one column of force, found depth_m, way_m"
        " (say --force-column NAME, or its number)\n"
    )
    assert main(["direct", str(tmp_path / "raw/cow/kinect/01")]) == 1
    assert "object.yaml: file: expected YAML, found nothing" in capsys.readouterr().err


def test_what_does_not_fit_is_said(root, monkeypatch):
    monkeypatch.chdir(root)
    with pytest.raises(ValueError, match="^onset: expected one of onset_force_n, .*found another"):
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
    scans = replace(capture, declared=capture.declared | {"template": {"scans": "scans"}})
    with pytest.raises(ValueError, match="template.file: expected a mesh, found scans"):
        _ = scans.template


def test_captures_of_a_point_share_its_table(monkeypatch, tmp_path):
    """It takes minutes, and a solid made anew is another one each time."""
    from palpate.commands import direct as command

    made = []
    monkeypatch.setattr("palpate.measurement.solid_of", lambda one, kept: made.append("solid") or 1)
    monkeypatch.setattr(
        "palpate.measurement.indentation_table", lambda one, solid: made.append(solid) or solid
    )
    points = [SimpleNamespace(capture=SimpleNamespace(point=name)) for name in ("08", "08", "11")]
    found = command._tables(points, SimpleNamespace(tables=None, solid=None))
    assert set(found) == {"08", "11"}
    assert made == ["solid", 1, 1]
