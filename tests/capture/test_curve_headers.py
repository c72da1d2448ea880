"""Text files of instruments: where their table is, which columns it has, in which units."""

import re

import numpy as np
import pytest
from instruments import DEPTH_M, E_STAR_PA, FORCE_N, MANNERS, RADIUS_M, written
from palpate import hertz
from palpate.capture.curves.curve import read_curve
from palpate.capture.curves.export import read_export


@pytest.mark.parametrize("manner", list(MANNERS))
def test_it_is_read_right(manner, tmp_path):
    path = tmp_path / "curve.txt"
    path.write_bytes(MANNERS[manner].content())
    words = MANNERS[manner].options.replace("--", "").replace("-", "_").split()
    curve = read_curve(path, **dict(zip(words[::2], words[1::2], strict=True)))
    found = hertz.fit(*curve.loading(), radius_m=RADIUS_M, indenter="parabola")
    assert found.reduced_modulus_pa == pytest.approx(E_STAR_PA, rel=0.01)
    assert curve.depth_sign == MANNERS[manner].signs[0]
    assert found.contact_m == pytest.approx(4e-4, rel=0.02)
    low, high = found.reduced_modulus_interval_pa
    assert low < found.reduced_modulus_pa < high


READ = {
    # A nanoindenter's contact depth is not its indentation's.
    "Displacement Into Surface (mm),Load (N),Contact Depth (mm)": "mm (Displacement Into Surface)",
    "Displacement Into Surface (mm),Load (N),Plastic depth (mm)": "mm (Displacement Into Surface)",
    "Displacement Into Surface (mm),Load (N),Max Displacement (mm)": "(Displacement Into Surface)",
    # Labelled comments and rows of units are headers.
    "# columns: verticalTipPosition vDeflection seriesTime\n# units: mm N s":
        "depth in mm (verticalTipPosition), force in N (vDeflection)",
    "Extension,Load,Strain\nmm,N,mm/mm": "depth in mm (Extension), force in N (Load)",
}  # fmt: skip


@pytest.mark.parametrize("header", READ)
def test_columns_are_found(header, tmp_path):
    mark = " " if header.startswith("#") else ","
    path = written(tmp_path, header, 1e3 * DEPTH_M, FORCE_N, 700 * DEPTH_M, mark=mark)
    assert READ[header] in read_curve(path).read


@pytest.mark.parametrize(
    ("unit", "newtons"), [("MN", 1e6), ("mN", 1e-3), ("KN", 1e3), ("UN", 1e-6)]
)
def test_meganewtons_are_no_millinewtons(unit, newtons, tmp_path):
    path = written(tmp_path, f"depth [mm],F [{unit}]", 1e3 * DEPTH_M, FORCE_N)
    assert read_curve(path).force_n.max() == pytest.approx(newtons * FORCE_N.max())


MISREAD = {
    "sample_n,disp_mm,reading": "expected one column of force",
    "Displacement (mm),Cycle N": "expected one column of force",
    "Stiffness N/mm,Force (N)": "expected one column of depth",
    "Torque N m,Force (N)": "expected one column of depth",
    "Time (m),Force (N)": "expected one column of depth",
    "Displacement (mm),Force (V)": r"Force \(V\): .* of force, found V \(force = volts times",
    "Displacement (mm),Load (mV/V)": r"found mV/V \(force = volts times N/V of a load cell",
    "Displacement (mm),Force (kPa)": r"found kPa \(another column",
    "z_mm,F_n,F_t": "F_n: expected a unit of force, found none .say --force-unit: N, mN",
    "z_um,F_N,F_T": "F_N: expected a unit of force, found none .say --force-unit",
    "DEPTH (UM),LOAD (MN)": r"LOAD .MN.: expected a unit of force, found MN in capitals alone",
    "z_mm,force_n,force_t": "columns: expected one column of force, found force_n, force_t",
    "depth_in,force_N": "depth_in: expected a unit of depth, found none .say --depth-unit",
    "Displacement rate (mm),Force (N)": "expected one column of depth",
}


@pytest.mark.parametrize("header", MISREAD)
def test_a_unit_alone_makes_no_column(header, tmp_path):
    columns = [np.arange(1, 31.0) ** (1 + k) for k in range(header.count(",") + 1)]
    path = written(tmp_path, header, *columns)
    with pytest.raises(ValueError, match=f"^{re.escape(str(path))}: .*{MISREAD[header]}"):
        read_curve(path)


@pytest.mark.parametrize(
    ("rows", "last"),
    [
        ('"0.1","999.50"\n"0.2","1,234.50"\n"0.3","12,400.25"\n', 12400.25),
        ("0.1;999.5\n0.2;1,234.5\n0.3;1,400.25\n", 1400.25),
        ("0,1;999,5\n0,2;1.234,5\n0,3;1.234.400,25\n", 1234400.25),
        ('250,"1,234"\n260,"1,300"\n270,"1,400"\n', None),
        ("1.234;999\n1.235;1.500\n1.236;1.600\n", None),
    ],
)
def test_thousands_are_never_guessed(rows, last, tmp_path):
    """A sign before three digits and another sign after them can be nothing else."""
    path = tmp_path / "curve.csv"
    mark = ";" if ";" in rows else ","
    path.write_text(f"Depth (um){mark}Force (mN)\n" + rows * 4)
    if last is None:
        with pytest.raises(ValueError, match="expected numbers without separators of thousands"):
            read_export(path)
    else:
        assert read_export(path).values[-1, 1] == last


def test_points_that_may_be_of_thousands_are_warned_of(tmp_path):
    columns, how = (57 + 1e3 * DEPTH_M, FORCE_N), {"mark": ";", "number": "{:.3f}"}
    path = written(tmp_path, "Weg (mm);Kraft (N)", *columns, **how)
    assert "numbers like 57.000 have points as of thousands" in read_curve(path).warnings[0]
    curve = read_curve(written(tmp_path, "Weg (mm);Kraft (N)", *columns, **how, decimal=","))
    assert np.ptp(curve.depth_m) == pytest.approx(1.4e-3)
    assert "numbers like 57,000 have commas as of thousands" in curve.warnings[0]


def test_cells_that_are_filled_later_hide_no_rows(tmp_path):
    """Two columns are empty in the first part of a table."""
    columns = 1e3 * DEPTH_M, FORCE_N, FORCE_N, FORCE_N
    path = written(tmp_path, "Depth (mm),Force (N),Temp,Hum", *columns)
    lines = path.read_text().splitlines()
    lines[1:92] = [",".join([*line.split(",")[:2], "", ""]) for line in lines[1:92]]
    path.write_text("\n".join(lines))
    assert len(read_curve(path).depth_m) == len(DEPTH_M)


def test_a_preamble_with_commas_hides_no_table(tmp_path):
    head = "\n".join([*["12,3,1,2024"] * 3, "Weg (mm);Kraft (N);Zeit (s)"])
    how = {"mark": ";", "decimal": ",", "number": "{:.3f}"}
    path = written(tmp_path, head, 1e3 * DEPTH_M, FORCE_N, 0 * FORCE_N, **how)
    assert "; as delimiter, decimal commas, 3 lines of preamble" in read_curve(path).read


def test_a_table_of_no_numbers_is_rejected(tmp_path):
    (path := tmp_path / "curve.csv").write_text("depth_mm,force_n\n" + "nan,nan\n" * 9)
    with pytest.raises(ValueError, match="rows: expected at least 5 rows .*, found 0 and 0 rows"):
        read_curve(path)


@pytest.mark.parametrize(
    ("head", "stated"),
    [
        ("Sample K 12", {}),
        ("Machine stiffness: 5000 N/m", {}),
        ("Tip radius: 5", {}),
        ("Tip radius: 5.0 um, glass", {"radius_m": 5e-6}),
        ("k (N/m),0.05", {"stiffness_n_m": 0.05}),
        ("# springConstant: 0.043", {"stiffness_n_m": 0.043}),
    ],
)
def test_what_a_preamble_states_of_the_indenter(head, stated, tmp_path):
    path = written(tmp_path, f"{head}\nPiezo (mm)\tForce (N)", 1e3 * DEPTH_M, FORCE_N, mark="\t")
    assert read_export(path).stated == pytest.approx(stated)
