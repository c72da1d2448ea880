"""Curves as instruments write them."""

import io
import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from instruments import E_STAR_PA, MANNERS, PLAIN, RADIUS_M, press
from palpate import hertz
from palpate.__main__ import main
from palpate.capture.check import check_object
from palpate.capture.curves.curve import read_curve
from palpate.capture.curves.export import read_export
from palpate.examine import examine_object
from scipy.signal import lfilter


def told(path, capsys, *options):
    """What the command prints for a program."""
    status = main(["hertz", str(path), "--radius-mm", f"{1e3 * RADIUS_M:g}", "--json", *options])
    printed = capsys.readouterr()
    assert status == 0, printed.err
    return json.loads(printed.out)


def test_there_are_forty():
    assert len(MANNERS) >= 40


@pytest.mark.parametrize("manner", list(MANNERS))
def test_it_is_read_right(manner, tmp_path, capsys):
    path = tmp_path / "curve.txt"
    path.write_bytes(MANNERS[manner].content())
    found = told(path, capsys, "--indenter", "parabola", *MANNERS[manner].options)
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.01)
    assert found["depth_sign"] == MANNERS[manner].signs[0]
    assert found["contact_m"] == pytest.approx(4e-4, rel=0.02)
    low, high = found["reduced_modulus_interval_pa"]
    assert low < found["reduced_modulus_pa"] < high


def test_what_was_found_is_said_in_a_line(tmp_path):
    path = tmp_path / "curve.txt"
    path.write_bytes(MANNERS["retract, everything at once"].content())
    assert read_curve(path).read == (
        "utf-16, ; as delimiter, decimal commas, 12 lines of preamble, depth in mm (Weg), force in"
        " mN (Kraft), depth sign turned, force sign turned, 681 samples: 281 of loading, 120 of"
        " hold, 280 of retract; the loading is fitted"
    )


def written(tmp_path, manner=PLAIN, name="curve.txt"):
    path = tmp_path / name
    path.write_bytes(manner.content())
    return path


def refused(path, capsys, *options):
    assert main(["hertz", str(path), "--radius-mm", "5", *options]) == 1
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert not any(word in printed.err for word in ("pandas", "token", "C error", "Traceback"))
    return printed.err


def test_what_an_option_does_not_fit_is_refused(tmp_path, capsys):
    assert "found a folder" in refused(tmp_path, capsys)
    path = written(tmp_path)
    assert "--depth-unit: expected one of m, cm, mm" in refused(path, capsys, "--depth-unit", "kN")
    line = refused(path, capsys, "--depth-column", "way")
    assert "--depth-column: expected one of Displacement (mm), Load (N), found way" in line
    line = refused(path, capsys, "--range-mm", "5", "6")
    assert "--range-mm: expected a part of the depth's column, 0 to 1.4 mm, found 5 to 6" in line


def test_standard_input_is_a_curve(monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(PLAIN.content())))
    assert told("-", capsys, "--indenter", "parabola")["reduced_modulus_pa"] == pytest.approx(
        E_STAR_PA, rel=0.02
    )


def test_a_column_of_weights_counts(tmp_path, capsys):
    depth, force = press()
    # Beyond a depth the force is another thing's, and its weight is none.
    force[depth > 1e-3] *= 2
    weights = np.where(depth > 1e-3, 0.0, 1.0)
    rows = [f"{1e3 * d:.6f},{f:.6f},{w:g}" for d, f, w in zip(depth, force, weights, strict=True)]
    path = tmp_path / "curve.csv"
    path.write_text("depth_mm,force_n,w\n" + "\n".join(rows) + "\n")
    law = ("--indenter", "parabola")
    assert told(path, capsys, *law)["reduced_modulus_pa"] > 1.2 * E_STAR_PA
    for used in (("--weights", "w"), ("--range-mm", "0", "1")):
        found = told(path, capsys, *law, *used)
        assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.02)


def test_several_curves_are_a_table(tmp_path, capsys):
    paths = [str(written(tmp_path, name=f"{k}.csv")) for k in range(2)]
    table, figure = tmp_path / "all.csv", tmp_path / "all.png"
    spoilt = tmp_path / "spoilt.csv"
    spoilt.write_text("no curve\n")
    given = [
        *paths,
        str(spoilt),
        "--radius-mm",
        "5",
        "--table",
        str(table),
        "--figure",
        str(figure),
    ]
    assert main(["hertz", *given]) == 1
    printed = capsys.readouterr()
    assert printed.err.startswith(f"error: {spoilt}: file: expected a text table")
    rows = pd.read_csv(table)
    assert list(rows["curve"]) == paths
    assert (rows["reduced_modulus_low_pa"] < rows["reduced_modulus_pa"]).all()
    assert figure.stat().st_size > 10_000
    assert main(["hertz", *paths, "--radius-mm", "5", "--figure", "fit.xyz"]) == 1
    assert "--figure: expected a file that ends with one of .png" in capsys.readouterr().err


def test_what_was_chosen_and_what_it_hangs_on_is_said(tmp_path, capsys):
    path = written(tmp_path)
    assert main(["hertz", str(path), "--radius-mm", "5"]) == 0
    text = capsys.readouterr().out
    assert "sneddon, since the indentation is 0.201 radii deep (above 0.1)" in text
    assert "baseline fitted, since 80 samples lie before the contact" in text
    assert re.search(r"contact at 0\.3\d+ \+- [\d.]+ mm, 1 mm deep; fair fit, res", text)
    assert re.search(r"depends on: by parabola E\* would be [\d.]+ kPa \(-\d", text)


def test_radii_of_bodies_go_together(tmp_path, capsys):
    path = written(tmp_path)
    flat = told(path, capsys, "--indenter", "parabola")["reduced_modulus_pa"]
    curved = told(path, capsys, "--object-radius-mm", "5", "--indenter", "parabola")
    assert curved["effective_radius_m"] == pytest.approx(0.0025)
    assert curved["reduced_modulus_pa"] == pytest.approx(np.sqrt(2) * flat)
    given = ["hertz", str(path), "--effective-radius-mm", "2.5", "--json"]
    assert main(given) == 0
    same = json.loads(capsys.readouterr().out)
    assert same["reduced_modulus_pa"] == pytest.approx(curved["reduced_modulus_pa"])
    assert main([*given, "--radius-mm", "5"]) == 1
    assert "expected no other radius, found one" in capsys.readouterr().err
    assert main(["hertz", str(path)]) == 1
    assert "--radius-mm: expected the sphere's radius, found none" in capsys.readouterr().err


def test_a_real_curve_as_another_program_fits_it(root, capsys):
    """E by nanite 4.2.3: paraboloid, whole approach, contact and baseline free."""
    folder = root / "tests/real/curves"
    for row in pd.read_csv(folder / "reference.csv").itertuples():
        path, radius = folder / row.file, f"{1e3 * row.radius_m:g}"
        given = ["hertz", str(path), "--radius-mm", radius, "--nu", f"{row.poisson_ratio:g}"]
        assert main([*given, "--indenter", "parabola", "--baseline", "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
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


def test_what_a_probes_file_says_counts_for_the_check(bench, tmp_path):
    depth, force = press()
    piezo = written_columns(tmp_path, "Piezo (mm),Force (N)", 1e3 * (depth + force / 60), force)
    shutil.copy(piezo, bench.folder / "08.csv")
    assert bench({"poisson_ratio": 0.4}, probe="ball") == []
    probe = {"stiffness_n_m": 60.0, "indenter": {"radius_m": 0.005}}
    found = examine_object(bench.folder, {}, {"ball": probe})
    assert any("force over 60 N/m taken off the depth" in line for line in found.found)
    found = examine_object(bench.folder, {}, {"ball": {"indenter": {"radius_m": 0.005}}})
    assert any("(curves.stiffness_n_m takes it off)" in line for line in found.doubts)


@pytest.mark.parametrize(
    ("curves", "changes", "expected"),
    [
        ({"poisson_ratio": [0.45, 0.3], "radius_m": 0.005}, {},
         "curves.poisson_ratio: expected the lower before the higher, found [0.45, 0.3]"),
        ({"poisson_ratio": 0.4}, {}, "probe: expected one of ball, or curves.radius_m, found none"),
        ({"poisson_ratio": 0.4, "radius_m": 0.005}, {"probe": "ball"},
         "curves.radius_m: expected none beside a probe, which has its own"),
    ],
)  # fmt: skip
def test_what_is_declared_wrong_is_said(bench, curves, changes, expected):
    (line,) = bench(curves, **changes)
    assert line.startswith(f"{bench.folder / 'object.yaml'}: {expected}")


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


def written_columns(tmp_path, header, *columns, name="curve.csv"):
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    path = tmp_path / name
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_what_gives_way_before_the_tip_is_taken_off(tmp_path, capsys):
    """A cantilever as soft as the contact: the piezo's way is not the tip's."""
    depth, force = press()
    stiffness = 60.0
    header = "Piezo (mm),Force (N)"
    path = written_columns(tmp_path, header, 1e3 * (depth + force / stiffness), force)
    law = ("--indenter", "parabola")
    found = told(path, capsys, *law)
    assert found["reduced_modulus_pa"] < 0.7 * E_STAR_PA
    assert any(line.startswith("Piezo is the way of the drive") for line in found["doubts"])
    found = told(path, capsys, *law, "--stiffness-n-m", f"{stiffness:g}")
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.01)
    assert not any("drive" in line for line in found["doubts"])
    assert "force over 60 N/m taken off the depth" in found["read"]


@pytest.mark.parametrize("name", ["Indentation", "tipPosition", "Tip z", "separation"])
def test_nothing_is_taken_off_the_tips_own_depth(name, tmp_path, capsys):
    depth, force = press()
    path = written_columns(tmp_path, f"{name} (mm),Force (N)", 1e3 * depth, force)
    found = told(path, capsys, "--indenter", "parabola", "--stiffness-n-m", "60")
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.01)
    assert f"{name} is the tip's own depth" in found["doubts"][0]


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("z (mm),delta (mm),force (N)", ()),
        ("Piezo (mm),Indentation (mm),Load (N)", ("--depth-column", "Piezo")),
    ],
)
def test_a_drive_beside_the_tips_depth_is_the_drives(header, options, tmp_path, capsys):
    depth, force = press()
    path = written_columns(tmp_path, header, 1e3 * (depth + force / 60), 1e3 * depth, force)
    law = ("--indenter", "parabola", "--stiffness-n-m", "60")
    found = told(path, capsys, *law, *options)
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.01)
    assert "force over 60 N/m taken off the depth" in found["read"]


@pytest.mark.parametrize("name", ["Depth", "Displacement"])
def test_a_depth_beside_its_drive_is_the_tips(name, tmp_path, capsys):
    """The drive's column is the depth and what the cantilever gives way by."""
    depth, force = press()
    header, piezo_mm = f"Piezo (um),{name} (mm),Load (N)", 1e6 * (2e-3 - depth - force / 60)
    path = written_columns(tmp_path, header, piezo_mm, 1e3 * depth, force)
    found = told(path, capsys, "--indenter", "parabola", "--stiffness-n-m", "60")
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.01)
    assert f"{name} is the tip's own depth" in found["doubts"][0]


def test_what_the_file_states_otherwise_is_said(tmp_path, capsys):
    depth, force = press()
    head = "Tip radius (um)\t4000\nSpring Constant: 60 N/m\nPiezo (mm)\tForce (N)"
    rows = [f"{1e3 * (d + f / 60):.9g}\t{f:.9g}" for d, f in zip(depth, force, strict=True)]
    (path := tmp_path / "curve.txt").write_text("\n".join([head, *rows]))
    found = told(path, capsys, "--stiffness-n-m", "60")
    assert found["doubts"][0] == "the file states radius_m 0.004, where 0.005 was given"
    assert not any("stiffness" in line for line in found["doubts"])
    assert read_curve(path, radius_m=0.004).doubts == read_curve(path).doubts
    for head, stated in {
        "Sample K 12": {},
        "Machine stiffness: 5000 N/m": {},
        "Tip radius: 5": {},
        "Tip radius: 5.0 um, glass": {"radius_m": 5e-6},
        "k (N/m),0.05": {"stiffness_n_m": 0.05},
        "# springConstant: 0.043": {"stiffness_n_m": 0.043},
    }.items():
        path.write_text("\n".join([head, "Piezo (mm)\tForce (N)", *rows]))
        assert read_export(path).stated == pytest.approx(stated)
    with pytest.raises(ValueError, match="stiffness_n_m: expected above 0, found 0"):
        read_curve(path, stiffness_n_m=0.0)


@pytest.mark.parametrize("other", ["Contact Depth", "Plastic depth", "Max Displacement"])
def test_a_nanoindenters_contact_depth_is_not_the_indentations(other, tmp_path):
    depth, force = press()
    header = f"Displacement Into Surface (mm),Load (N),{other} (mm)"
    curve = read_curve(written_columns(tmp_path, header, 1e3 * depth, force, 700 * depth))
    assert "depth in mm (Displacement Into Surface)" in curve.read


def test_meganewtons_are_no_millinewtons(tmp_path):
    depth, force = press()
    for unit, newtons in (("MN", 1e6), ("mN", 1e-3), ("KN", 1e3), ("UN", 1e-6)):
        path = written_columns(tmp_path, f"depth [mm],F [{unit}]", 1e3 * depth, force)
        assert read_curve(path).force_n.max() == pytest.approx(newtons * force.max())


@pytest.mark.parametrize("power", [0.5, 0.9, 1.0])
def test_a_force_that_softens_keeps_the_files_signs(power, tmp_path):
    depth = np.linspace(0, 5, 200)
    force = depth**power + 0.01 * np.random.default_rng(1).normal(size=200)
    curve = read_curve(written_columns(tmp_path, "depth_mm,force_n", depth, force))
    assert "turned" not in curve.read
    assert curve.force_n[-1] > curve.force_n[0] and curve.depth_m[-1] > curve.depth_m[0]


def test_a_retract_alone_is_turned_and_said(tmp_path):
    depth, force = press()
    curve = read_curve(written_columns(tmp_path, "d (mm),F (N)", 1e3 * depth[::-1], force[::-1]))
    assert curve.depth_m[0] < curve.depth_m[-1]
    assert any("its rows were turned" in line for line in curve.doubts)


@pytest.mark.parametrize(("way", "sign"), [(-1, 1), (1, -1), (-1, -1)])
def test_a_retract_alone_is_read_whichever_way_its_columns_count(way, sign, tmp_path, capsys):
    depth, force = press()
    columns = 20 + way * 1e3 * depth[::-1], sign * force[::-1]
    path = written_columns(tmp_path, "Height (mm),Force (N)", *columns)
    found = told(path, capsys, "--indenter", "parabola")
    assert found["reduced_modulus_pa"] == pytest.approx(E_STAR_PA, rel=0.01)
    assert any("its rows were turned" in line for line in found["doubts"])


def test_a_spring_that_the_file_states_is_asked_for(tmp_path, capsys):
    depth, force = press()
    rows = [f"{1e3 * (d + f / 60):.9g}\t{f:.9g}" for d, f in zip(depth, force, strict=True)]
    (path := tmp_path / "curve.txt").write_text("\n".join(["k (N/m)\t60", HEAD, *rows]))
    line = (
        "the file states a spring of 60 N/m: --stiffness-n-m takes it off, if Ramp is the drive's"
    )
    assert any(one.startswith(line) for one in told(path, capsys)["doubts"])
    assert "is Ramp the tip's own, or it another" in refused(path, capsys, "--stiffness-n-m", "1")


HEAD = "Ramp (mm)\tForce (N)"


def test_a_radius_in_another_unit_is_doubted(tmp_path, capsys):
    assert main(["hertz", str(written(tmp_path)), "--radius-mm", "5000"]) == 0
    assert "radii deep: is the unit of the radius another?" in capsys.readouterr().out


def test_of_cycles_the_deepest_loading_is_taken(tmp_path):
    depth, force = press()
    way = [part * depth[::step] for part in (0.8, 0.9, 1.0) for step in (1, -1)]
    load = [part * force[::step] for part in (0.8, 0.9, 1.0) for step in (1, -1)]
    header = "depth_mm,force_n"
    curve = read_curve(written_columns(tmp_path, header, 1e3 * np.hstack(way), np.hstack(load)))
    assert (curve.phases.loading.start, curve.phases.loading.stop) == (4 * 281 - 1, 5 * 281)
    assert "the record holds 3 loadings: the deepest is fitted" in curve.doubts


def test_a_glitch_is_no_deepest_sample(tmp_path):
    depth, force = press(retract=True)
    depth[200] = 1.7e-3
    curve = read_curve(written_columns(tmp_path, "depth_mm,force_n", 1e3 * depth, force))
    assert curve.phases.loading.stop == 281


def test_an_outlier_is_named(tmp_path, capsys):
    depth, force = press()
    force[120] = -500
    line = refused(written_columns(tmp_path, "depth_mm,force_n", 1e3 * depth, force), capsys)
    assert "force: expected no sample that leaves its neighbours" in line
    assert "found -500 in row 121 of the numbers" in line


def test_a_fit_without_a_press_is_refused(tmp_path, capsys):
    depth = np.linspace(0, 5, 60)
    force = np.where(depth > 4.95, 1.0, 1 - 0.19 * depth)
    path = written_columns(tmp_path, "depth_mm,force_n", depth, force)
    line = refused(path, capsys)
    assert re.search("contact: expected 3 samples or more|force: expected a rise", line), line


def test_samples_without_weight_count_for_nothing(tmp_path):
    depth, force = press()
    rng = np.random.default_rng(2)
    kept = rng.random(len(depth)) < 0.2
    given = hertz.fit(depth, force, radius_m=RADIUS_M, weights=kept.astype(float))
    alone = hertz.fit(depth[kept], force[kept], radius_m=RADIUS_M)
    assert given.reduced_modulus_interval_pa == pytest.approx(alone.reduced_modulus_interval_pa)
    with pytest.raises(ValueError, match="weights: expected one from 0"):
        hertz.fit(depth, force, radius_m=RADIUS_M, weights=np.zeros(len(depth)))


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
        assert any("follow a pattern" in line for line in found.doubts)
    assert held >= 15


MISREAD = {
    "sample_n,disp_mm,reading": "expected one column of force",
    "Displacement (mm),Cycle N": "expected one column of force",
    "Stiffness N/mm,Force (N)": "expected one column of depth",
    "Torque N m,Force (N)": "expected one column of depth",
    "Time (m),Force (N)": "expected one column of depth",
    "Displacement (mm),Force (V)": r"Force \(V\): expected a unit of force, found V \(force = defl",
    "Displacement (mm),Force (kPa)": r"found kPa \(another column",
    "z_mm,F_n,F_t": "F_n: expected a unit of force, found none .say --force-unit: N, mN",
    "z_um,F_N,F_T": "F_N: expected a unit of force, found none .say --force-unit",
    "DEPTH (UM),LOAD (MN)": r"LOAD .MN.: expected a unit of force, found MN in capitals alone",
    "z_mm,force_n,force_t": "columns: expected one column of force, found force_n, force_t",
    "depth_in,force_N": "depth_in: expected a unit of depth, found none .say --depth-unit",
    "Displacement rate (mm),Force (N)": "expected one column of depth",
}


@pytest.mark.parametrize("header", MISREAD)
def test_a_unit_alone_makes_no_column(header, tmp_path, capsys):
    columns = [np.arange(1, 31.0) ** (1 + k) for k in range(header.count(",") + 1)]
    line = refused(written_columns(tmp_path, header, *columns), capsys)
    assert re.search(MISREAD[header], line), line


@pytest.mark.parametrize(
    ("rows", "last"),
    [
        ('"0.1","999.50"\n"0.2","1,234.50"\n"0.3","12,400.25"\n', 12400.25),
        ("0.1;999.5\n0.2;1,234.5\n0.3;1,400.25\n", 1400.25),
        ("0,1;999,5\n0,2;1.234,5\n0,3;1.234.400,25\n", 1234400.25),
        ('250,"1,234"\n260,"1,300"\n270,"1,400"\n', None),
    ],
)
def test_thousands_are_never_guessed(rows, last, tmp_path, capsys):
    """A sign before three digits and another sign after them can be nothing else."""
    path = tmp_path / "curve.csv"
    mark = ";" if ";" in rows else ","
    path.write_text(f"Depth (um){mark}Force (mN)\n" + rows * 4)
    if last is None:
        assert "expected numbers without separators of thousands" in refused(path, capsys)
    else:
        assert read_export(path).values[-1, 1] == last


def test_cells_that_are_filled_later_hide_no_rows(tmp_path):
    """Two columns are empty in the first part of a table."""
    depth, force = press()
    rows = [
        f"{k},{1e3 * d:.5f},{f:.5f}{',20.1,45' if k > 90 else ',,'}"
        for k, (d, f) in enumerate(zip(depth, force, strict=True))
    ]
    path = tmp_path / "curve.csv"
    path.write_text("\n".join(["Time (s),Depth (mm),Force (N),Temp,Hum", *rows]) + "\n")
    assert len(read_curve(path).depth_m) == len(depth)


def test_a_preamble_with_commas_hides_no_table(tmp_path):
    depth, force = press()
    rows = [
        f"{1e3 * d:.3f};{f:.3f};0,0".replace(".", ",") for d, f in zip(depth, force, strict=True)
    ]
    path = tmp_path / "curve.csv"
    lines = [*["12,3,1,2024"] * 3, "Weg (mm);Kraft (N);Zeit (s)", *rows]
    path.write_text("\n".join(lines) + "\n")
    assert "; as delimiter, decimal commas, 3 lines of preamble" in read_curve(path).read


def test_points_that_may_be_of_thousands_are_doubted(tmp_path):
    depth, force = press()
    rows = [f"{57 + 1e3 * d:.3f};{f:.4f}" for d, f in zip(depth, force, strict=True)]
    path = tmp_path / "curve.csv"
    path.write_text("Weg (mm);Kraft (N)\n" + "\n".join(rows) + "\n")
    assert "numbers like 57.000 have points as of thousands" in read_curve(path).doubts[0]


def test_decimal_commas_of_three_places_are_no_thousands(tmp_path):
    depth, force = press()
    rows = [f"{1e3 * d:.3f};{f:.3f}".replace(".", ",") for d, f in zip(depth, force, strict=True)]
    path = tmp_path / "curve.csv"
    path.write_text("Weg (mm);Kraft (N)\n" + "\n".join(rows) + "\n")
    assert read_curve(path).depth_m.max() == pytest.approx(1.4e-3)


def test_labelled_comments_and_unit_rows_are_headers(tmp_path):
    depth, force = press()
    rows = [f"{d:.9g} {f:.9g} {k}" for k, (d, f) in enumerate(zip(-depth, force, strict=True))]
    path = tmp_path / "jpk.txt"
    head = ["# columns: verticalTipPosition vDeflection seriesTime", "# units: m N s"]
    path.write_text("\n".join([*head, *rows]) + "\n")
    assert "depth in m (verticalTipPosition), force in N (vDeflection)" in read_curve(path).read
    rows = [f"{1e3 * d:.9g},{f:.9g},{d / 0.01:.6f}" for d, f in zip(depth, force, strict=True)]
    path.write_text("\n".join(["Extension,Load,Strain", "mm,N,mm/mm", *rows]) + "\n")
    assert "depth in mm (Extension), force in N (Load)" in read_curve(path).read


OPTIONS = {
    ("--radius-mm", "-5"): "--radius-mm: expected a number above 0, found -5",
    ("--radius-mm", "inf"): "--radius-mm: expected a number above 0, found inf",
    (
        "--half-angle-deg",
        "95",
    ): "--half-angle-deg: expected a number above 0 and below 90, found 95",
    ("--indenter", "cone"): "--half-angle-deg: expected the cone's half angle, found none",
    (
        "--radius-mm",
        "5",
        "--nu",
        "0.7",
    ): "--nu: expected a Poisson's ratio from 0 to 0.5, found 0.7",
    ("--radius-mm", "5", "--thickness-mm", "1"): "--thickness-mm: expected at least ",
}


@pytest.mark.parametrize("given", OPTIONS)
def test_options_are_named_in_their_own_units(given, tmp_path, capsys):
    path = written(tmp_path)
    assert main(["hertz", str(path), *given]) == 1
    line = capsys.readouterr().err
    assert OPTIONS[given] in line and line.count("\n") == 1
