"""The closing lines of a run."""

import csv

import pytest
from palpate.modulus import VERDICTS
from palpate.report import tables
from palpate.report.estimate_rows import summary
from palpate.workflow.closing import ARTEFACTS, FILES, closing_lines


def of_captures(name, sensor, rows, **same):
    """Rows of captures."""
    known = {"object": name, "sensor": sensor, "provenance": "simulated"} | same
    return [known | {"capture": row["point"]} | row for row in rows]


def hertz(name, sensor, moduli, **same):
    points = [f"{8 + i:02d}" for i in range(len(moduli))]
    found = zip(points, moduli, strict=True)
    rows = [{"point": point, "reduced_modulus_pa": E, "method": "hertz"} for point, E in found]
    return of_captures(name, sensor, rows, **same)


def joint(name, sensor, *, captures, **same):
    moduli = {"youngs_modulus": 250e3, "youngs_modulus_1s": 225e3, "reduced_modulus": 298e3}
    moduli |= {"effective_reduced_modulus": 310e3}
    row = {"point": "all", "method": "direct_joint", "recommended": True, "captures": captures}
    for quantity, value in moduli.items():
        row |= {f"{quantity}_pa": value, f"{quantity}_low_pa": 0.9 * value}
        row |= {f"{quantity}_high_pa": 1.1 * value, f"{quantity}_verdict": "identified"}
    nu = {"poisson_ratio": 0.4, "poisson_ratio_low": 0.25, "poisson_ratio_high": 0.49}
    return of_captures(name, sensor, [row | nu | {"poisson_ratio_verdict": "bounded"}], **same)


def write(folder, *rows):
    """A results folder with a summary of the workflow's own columns."""
    table = tables.rounded(summary([one for part in rows for one in part]))
    put(folder, "objects.html", "report.html", "tables/resources.csv")
    table.to_csv(folder / "summary.csv", index=False)


def put(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("made")


@pytest.fixture
def ball(tmp_path):
    rows = hertz("ball", "kinect", [25000, 27000, 32000])
    write(tmp_path, rows, joint("ball", "kinect", captures=3))
    return tmp_path


def test_closing_gives_the_recommended_moduli_first_with_intervals_and_verdicts(ball):
    lines = closing_lines(ball)
    assert lines[0].endswith(": objects.html, report.html, summary.csv, tables/")
    place = lines.index("ball, kinect (simulated: captures of the virtual lab)")
    assert lines[place + 1 : place + 7] == [
        "  effective E*  310.0 kPa (279.0 to 341.0), identified",
        "  E at once     250.0 kPa (225.0 to 275.0), identified",
        "  E after 1 s   225.0 kPa (202.5 to 247.5), identified",
        "  nu            0.40 (0.25 to 0.49), bounded",
        "  E*            298.0 kPa (268.2 to 327.8), identified",
        "  from 3 captures",
    ]
    assert f"bounded: {VERDICTS['bounded']}." in lines


def test_closing_of_a_recorded_object_of_ones_own(tmp_path):
    cow = {"provenance": "recorded"}
    write(
        tmp_path,
        hertz("toy_cow", "bench_cam", [25000], **cow),
        joint("toy_cow", "bench_cam", captures=1, **cow),
    )
    put(tmp_path, "toy_cow/report.html")
    lines = closing_lines(tmp_path)
    assert ", toy_cow/report.html, summary.csv" in lines[0]
    place = lines.index("  from 1 capture")
    assert lines[place + 1] == f"  page: {tmp_path}/toy_cow/report.html"
    assert not [line for line in lines if "imulated" in line or "of the study's" in line]


def test_closing_says_what_to_open_in_a_browser(ball):
    line = f"For a browser: {ball}/report.html"
    assert line in closing_lines(ball)
    (ball / "report.html").unlink()
    lines = closing_lines(ball)
    assert line not in lines and not [one for one in lines if one.startswith("  page: ")]


def test_closing_says_where_nothing_is_recommended(tmp_path):
    only_hertz = hertz("pad", "kinect", [25000])
    write(tmp_path, only_hertz, joint("ball", "kinect", captures=2))
    assert "  none: no capture of it is estimated directly" in closing_lines(tmp_path)


def test_closing_counts_the_studys_tables_and_figures(ball):
    with ARTEFACTS.open(newline="") as stream:
        names = [FILES[row["kind"]].format(row["id"]) for row in csv.DictReader(stream)]
    put(ball, *names[1:])
    assert closing_lines(ball)[1] == "60 of the study's 61 tables and figures are there."
