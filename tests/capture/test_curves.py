"""Curves of force against depth: the command, which samples count, what is taken off the depth."""

import io
import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from instruments import DEPTH_M, E_STAR_PA, FORCE_N, MANNERS, PLAIN, RADIUS_M, indentation, written
from palpate import hertz
from palpate.__main__ import main
from palpate.capture.check import check_object
from palpate.capture.curves.curve import read_curve
from palpate.examine import examine_object
from scipy.signal import lfilter

PARABOLA = ("--indenter", "parabola")
# Way of a drive before a spring of 60 N/m.
DRIVE_M = DEPTH_M + FORCE_N / 60


def fitted(path, capsys, *options, radius=("--radius-mm", f"{1e3 * RADIUS_M:g}")):
    """What the command prints for a program."""
    status = main(["hertz", str(path), *radius, "--json", *options])
    printed = capsys.readouterr()
    assert status == 0, printed.err
    return json.loads(printed.out)


def rejected(path, capsys, *options):
    assert main(["hertz", str(path), *options]) == 1
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.count("\n") == 1
    assert not any(word in printed.err for word in ("pandas", "token", "C error", "Traceback"))
    return printed.err


@pytest.fixture
def plain(tmp_path):
    (path := tmp_path / "plain.txt").write_bytes(PLAIN.content())
    return path


BALL = ("--radius-mm", "5")
OPTIONS = {
    (*BALL, "--depth-unit", "kN"): "--depth-unit: expected one of m, cm, mm",
    (*BALL, "--depth-column", "way"):
        "--depth-column: expected one of Displacement (mm), Load (N), found way",
    (*BALL, "--range-mm", "5", "6"):
        "--range-mm: expected a part of the depth's column, 0 to 1.4 mm, found 5 to 6",
    (*BALL, "--figure", "fit.xyz"): "--figure: expected a file that ends with one of .png",
    (): "--radius-mm: expected the sphere's radius, found none",
    ("--radius-mm", "-5"): "--radius-mm: expected a number above 0, found -5",
    ("--radius-mm", "inf"): "--radius-mm: expected a number above 0, found inf",
    ("--half-angle-deg", "95"):
        "--half-angle-deg: expected a number above 0 and below 90, found 95",
    ("--indenter", "cone"): "--half-angle-deg: expected the cone's half angle, found none",
    (*BALL, "--nu", "0.7"): "--nu: expected a Poisson's ratio from 0 to 0.5, found 0.7",
    (*BALL, "--thickness-mm", "1"): "--thickness-mm: expected at least ",
}  # fmt: skip


def test_an_option_that_does_not_fit_is_named_in_its_own_unit(plain, tmp_path, capsys):
    for given, line in OPTIONS.items():
        assert line in rejected(plain, capsys, *given)
    assert "found a folder" in rejected(tmp_path, capsys, *BALL)


def test_standard_input_is_a_curve(monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(PLAIN.content())))
    found = fitted("-", capsys, *PARABOLA)
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.02)


def test_a_range_leaves_samples_out(tmp_path, capsys):
    depth, force = indentation()
    # Beyond a depth the force is another thing's.
    force[depth > 1e-3] *= 2
    path = written(tmp_path, "depth_mm,force_n", 1e3 * depth, force)
    assert fitted(path, capsys, *PARABOLA)["reduced_modulus_pa"] > 1.2 * E_STAR_PA
    found = fitted(path, capsys, *PARABOLA, "--range-mm", "0", "1")
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.02)


def test_several_curves_are_a_table(plain, tmp_path, capsys):
    paths = [str(plain), str(shutil.copy(plain, tmp_path / "b.csv"))]
    table, figure, other = (tmp_path / name for name in ("all.csv", "all.png", "other.csv"))
    other.write_text("no curve\n")
    given = [*paths, str(other), *BALL, "--table", str(table), "--figure", str(figure)]
    assert main(["hertz", *given]) == 1
    assert capsys.readouterr().err.startswith(f"error: {other}: file: expected a text table")
    rows = pd.read_csv(table)
    assert list(rows["curve"]) == paths
    assert (rows["reduced_modulus_low_pa"] < rows["reduced_modulus_pa"]).all()
    assert figure.stat().st_size > 10_000


def test_a_real_curve_as_another_program_fits_it(root, capsys):
    """E by nanite 4.2.3: paraboloid, whole approach, contact and baseline free."""
    folder = root / "tests/real/curves"
    for row in pd.read_csv(folder / "reference.csv").itertuples():
        given = ["--nu", f"{row.poisson_ratio:g}", *PARABOLA, "--baseline"]
        radius = ("--radius-mm", f"{1e3 * row.radius_m:g}")
        found = fitted(folder / row.file, capsys, *given, radius=radius)
        assert found["youngs_modulus_pa"] == pytest.approx(row.youngs_modulus_pa, rel=5e-4)


@pytest.fixture
def bench(tmp_path, root):
    """An object with a curve and nothing else: declared, written, checked."""
    folder = tmp_path / "block"
    folder.mkdir()
    shutil.copy(root / "tests/sample/raw/foam_block/template.ply", folder)
    spec = yaml.safe_load((root / "tests/sample/raw/foam_block/object.yaml").read_text())
    del spec["probe"]
    spec |= {"object": "block", "curves": {"poisson_ratio": 0.4, "radius_m": 0.005}}
    (folder / "08.csv").write_bytes(MANNERS["german"].content())

    def checked(curves=None, **changes):
        block = spec["curves"] if curves is None else curves
        (folder / "object.yaml").write_text(yaml.safe_dump(spec | {"curves": block} | changes))
        return check_object(folder, {}, {"ball": {}})

    checked.folder = folder
    return checked


def test_a_curve_without_a_camera_is_a_capture(bench):
    assert bench() == []
    assert bench({"poisson_ratio": [0.3, 0.45], "radius_m": 0.005}) == []
    found = examine_object(bench.folder, {}, {"ball": {}})
    assert any(line.startswith("curve 08: ; as delimiter, decimal commas") for line in found.found)
    (line,) = bench({"poisson_ratio": 0.4})
    assert line.endswith("probe: expected one of ball, or curves.radius_m, found none")


def test_what_a_probes_file_says_counts_for_the_check(bench):
    written(bench.folder, "Piezo (mm),Force (N)", 1e3 * DRIVE_M, FORCE_N, name="08.csv")
    assert bench({"poisson_ratio": 0.4}, probe="ball") == []
    probe = {"stiffness_n_m": 60.0, "indenter": {"radius_m": 0.005}}
    found = examine_object(bench.folder, {}, {"ball": probe})
    assert any("force over 60 N/m taken off the depth" in line for line in found.found)
    found = examine_object(bench.folder, {}, {"ball": {"indenter": {"radius_m": 0.005}}})
    assert any("(curves.stiffness_n_m takes it off)" in line for line in found.warnings)


def test_a_curve_that_is_none_is_said(bench):
    (bench.folder / "08.csv").write_text("depth;force\n1;2\n2;3\n3;4\n4;5\n5;6\n")
    (line,) = bench()
    assert "depth: expected a unit of depth, found none (say curves.depth_unit" in line
    (bench.folder / "08.csv").rename(bench.folder / "99.csv")
    (line,) = bench()
    assert "99.csv: point: expected one of" in line
    (bench.folder / "99.csv").unlink()
    (line,) = bench()
    assert "curves: expected" in line and line.endswith("<point>.csv, found none")


SPRING = ("--stiffness-n-m", "60")
TAKEN_OFF = "force over 60 N/m taken off the depth"


def test_what_gives_way_before_the_tip_is_taken_off(tmp_path, capsys):
    """A cantilever as soft as the contact: the piezo's way is not the tip's."""
    path = written(tmp_path, "Piezo (mm),Force (N)", 1e3 * DRIVE_M, FORCE_N)
    found = fitted(path, capsys, *PARABOLA)
    assert found["reduced_modulus_pa"] < 0.7 * E_STAR_PA
    assert any(line.startswith("Piezo is the way of the drive") for line in found["warnings"])
    assert "drive" not in " ".join(fitted(path, capsys, *PARABOLA, *SPRING)["warnings"])
    with pytest.raises(ValueError, match="stiffness_n_m: expected above 0, found 0"):
        read_curve(path, stiffness_n_m=0.0)


@pytest.mark.parametrize(
    ("header", "tip", "options"),
    [
        ("Piezo (mm),Force (N)", None, ()),
        ("z (mm),Force (N),delta (mm)", None, ()),
        ("Piezo (mm),Load (N),Indentation (mm)", None, ("--depth-column", "Piezo")),
        ("Indentation (mm),Force (N)", "Indentation", ()),
        ("tipPosition (mm),Force (N)", "tipPosition", ()),
        ("Tip z (mm),Force (N)", "Tip z", ()),
        ("separation (mm),Force (N)", "separation", ()),
        # The drive's column is the depth and what the cantilever gives way by.
        ("Depth (mm),Load (N),Piezo (um)", "Depth", ()),
        ("Displacement (mm),Load (N),Piezo (um)", "Displacement", ()),
    ],
)
def test_a_spring_is_taken_off_a_drives_depth_alone(header, tip, options, tmp_path, capsys):
    columns = [1e3 * DRIVE_M, FORCE_N, 1e3 * DEPTH_M]
    if tip:
        columns = [1e3 * DEPTH_M, FORCE_N, 1e6 * (2e-3 - DRIVE_M)]
    path = written(tmp_path, header, *columns[: header.count(",") + 1])
    found = fitted(path, capsys, *PARABOLA, *SPRING, *options)
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.01)
    assert (TAKEN_OFF in found["read"]) == (tip is None)
    assert tip is None or f"{tip} is the tip's own depth" in found["warnings"][0]


def test_what_the_file_states_otherwise_is_said(tmp_path, capsys):
    head = "Tip radius (um)\t4000\nSpring Constant: 60 N/m\nRamp (mm)\tForce (N)"
    path = written(tmp_path, head, 1e3 * DRIVE_M, FORCE_N, mark="\t")
    found = fitted(path, capsys, *SPRING)
    assert "the file states radius_m 0.004, where 0.005 was given" in found["warnings"]
    assert not any("stiffness" in line for line in found["warnings"])
    assert read_curve(path, radius_m=0.004).warnings == read_curve(path).warnings
    line = "the file states a spring of 60 N/m: --stiffness-n-m takes it off, if Ramp is the dr"
    assert any(one.startswith(line) for one in fitted(path, capsys)["warnings"])
    line = rejected(path, capsys, *BALL, "--stiffness-n-m", "1")
    assert "is Ramp the tip's own, or it another" in line


@pytest.mark.parametrize("power", [0.5, 0.9, 1.0])
def test_a_force_that_softens_keeps_the_files_signs(power, tmp_path):
    depth = np.linspace(0, 5, 200)
    force = depth**power + 0.01 * np.random.default_rng(1).normal(size=200)
    curve = read_curve(written(tmp_path, "depth_mm,force_n", depth, force))
    assert "turned" not in curve.read
    assert curve.force_n[-1] > curve.force_n[0] and curve.depth_m[-1] > curve.depth_m[0]


@pytest.mark.parametrize(("way", "sign"), [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_a_retract_alone_is_turned_whichever_way_its_columns_count(way, sign, tmp_path, capsys):
    columns = 20 + way * 1e3 * DEPTH_M[::-1], sign * FORCE_N[::-1]
    path = written(tmp_path, "Height (mm),Force (N)", *columns)
    found = fitted(path, capsys, *PARABOLA)
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.01)
    assert any("its rows were turned" in line for line in found["warnings"])
    assert any("not plain" in one and "to begin pressed" in one for one in found["warnings"])


def test_of_cycles_the_deepest_loading_is_taken(tmp_path):
    way = [part * DEPTH_M[::step] for part in (0.8, 0.9, 1.0) for step in (1, -1)]
    load = [part * FORCE_N[::step] for part in (0.8, 0.9, 1.0) for step in (1, -1)]
    path = written(tmp_path, "depth_mm,force_n", 1e3 * np.hstack(way), np.hstack(load))
    curve = read_curve(path)
    assert (curve.phases.loading.start, curve.phases.loading.stop) == (4 * 281 - 1, 5 * 281)
    assert "the record holds 3 loadings: the deepest is fitted" in curve.warnings


@pytest.mark.parametrize(("way", "sign"), [(1, 1), (-1, 1), (1, -1), (-1, -1)])
@pytest.mark.parametrize("last", [1.0, 0.9])
def test_cycles_that_begin_pressed_are_fitted_where_they_are_free_before(last, way, sign, tmp_path):
    """The retract that the record begins with is softer, and counts for nothing."""
    depths = [DEPTH_M[::-1], last * DEPTH_M, last * DEPTH_M[::-1]]
    forces = [0.6 * FORCE_N[::-1], FORCE_N, 0.6 * FORCE_N[::-1]]
    columns = 20 + way * 1e3 * np.hstack(depths), sign * np.hstack(forces)
    curve = read_curve(written(tmp_path, "Height (mm),Force (N)", *columns))
    loading = curve.phases.loading
    assert (loading.start, loading.stop) == pytest.approx((281, 562), abs=2)
    assert "turned" not in curve.read.replace("sign turned", "")
    assert np.allclose(curve.loading()[1][-1], FORCE_N[-1], rtol=0.02)
    assert any("the record begins pressed: its first 28" in line for line in curve.warnings)


def test_a_glitch_is_no_deepest_sample_and_an_outlier_is_named(tmp_path):
    depth, force = indentation(retract=True)
    depth[200] = 1.7e-3
    curve = read_curve(written(tmp_path, "depth_mm,force_n", 1e3 * depth, force))
    assert curve.phases.loading.stop == 281
    depth, force = indentation()
    force[120] = -500
    line = "force: expected no sample that leaves its neighbours .*found -500 in row 121 of the num"
    with pytest.raises(ValueError, match=line):
        read_curve(written(tmp_path, "depth_mm,force_n", 1e3 * depth, force))


def test_a_fit_without_an_indentation_is_rejected(tmp_path, capsys):
    depth = np.linspace(0, 5, 60)
    force = np.where(depth > 4.95, 1.0, 1 - 0.19 * depth)
    line = rejected(written(tmp_path, "depth_mm,force_n", depth, force), capsys, *BALL)
    assert re.search("contact: expected 3 samples or more|force: expected a rise", line), line


def test_intervals_allow_for_noise_that_drifts():
    """First-order noise of 0.99 from sample to sample: 2,000 of them are worth ten."""
    depth = np.linspace(-1e-3, 1e-3, 2000)
    exact = 4 / 3 * 2e4 * np.sqrt(0.005) * np.maximum(depth, 0) ** 1.5
    held = 0
    for seed in range(20):
        drift = lfilter([1], [1, -0.99], np.random.default_rng(seed).normal(size=2000))
        noisy = exact + 0.01 * exact.max() * drift / np.std(drift)
        found = hertz.fit(depth, noisy, radius_m=0.005, indenter="parabola", baseline=True)
        low, high = found.reduced_modulus_interval_pa
        held += low < 2e4 < high
        assert any("follow a pattern" in line for line in found.warnings)
    assert held >= 15
