"""The command ``palpate export``: cards that are read back, and what it rejects in one line."""

import json
import re
import xml.etree.ElementTree as ET

import felupe
import numpy as np
import pandas as pd
import pytest
from palpate.__main__ import main
from palpate.estimate.relaxation import relaxed_share
from palpate.modulus import LABELS, Modulus
from palpate.report import tables
from palpate.report.estimate_rows import direct_rows, summary
from palpate.report.material import Material
from palpate.report.material_cards import PROGRAMMES, UNITS
from palpate.solid.laws import NEO_HOOKEAN
from test_estimate_rows import estimate as any_estimate

E, NU = 24130.0, 0.31
FRACTIONS, TIMES_S = (0.08, 0.05), (0.2, 5.0)
YOUNG = Modulus(E, 23000.0, 25500.0, "identified", "Pa")
RATIO = Modulus(NU, 0.25, 0.37, "identified", "1")
MATERIAL = Material("a---b", YOUNG, RATIO, ("doubtful: a -- b",), FRACTIONS, TIMES_S)
SMALL = 1e-6


def stress_of(material):
    return lambda F: material.gradient([F[:, :, None, None], None])[0][..., 0, 0]


def of_febio(element):
    """Law of FEBio's unconstrained Ogden material (user's manual, "Ogden Unconstrained")."""
    c, m, cp = (float(element.find(name).text) for name in ("c1", "m1", "cp"))

    def stress(F):
        J = np.linalg.det(F)
        squares, axes = np.linalg.eigh(F @ F.T)
        cauchy = cp * (J - 1) + c / m * (squares ** (m / 2) - 1) / J
        return J * (axes * cauchy) @ axes.T @ np.linalg.inv(F).T

    return stress


def law_of(name, *, unit="m", material=MATERIAL):
    """Law (deformation gradient to first Piola-Kirchhoff stress) of a card."""
    text = PROGRAMMES[name].write(material, UNITS[unit])
    if name == "febio":
        return of_febio(ET.fromstring(text.encode()).find(".//elastic"))
    if name == "abaqus":  # NEO HOOKE, which is that of another material of FElupe
        C10, D1 = map(float, re.search(r"\*HYPERELASTIC, NEO HOOKE.*\n(.+), (.+)\n", text).groups())
        return stress_of(felupe.NeoHooke(mu=2 * C10, bulk=2 / D1))
    names = {}
    exec(text, names)
    return stress_of(names["material"])


@pytest.mark.parametrize("unit, pascals", [("m", 1.0), ("mm", 1e-6)])
@pytest.mark.parametrize("name", PROGRAMMES)
def test_small_strain_gives_e_and_nu(name, unit, pascals):
    P = law_of(name, unit=unit)(np.diag([1 + SMALL, 1 - NU * SMALL, 1 - NU * SMALL]))
    assert P[0, 0] == pytest.approx(pascals * E * SMALL, rel=1e-5)
    # Free sides: nu is that of the card.
    assert abs(P[1, 1]) < 1e-4 * P[0, 0]


@pytest.mark.parametrize("name", ["felupe", "febio"])
def test_at_finite_strain_the_law_is_our_own(name):
    F = np.eye(3) + 0.2 * np.random.default_rng(4).normal(size=(3, 3))
    expected = E * NEO_HOOKEAN.stress(F, NU)
    np.testing.assert_allclose(law_of(name)(F), expected, rtol=1e-8, atol=1e-8 * E)


def test_relaxation_of_febio_and_abaqus_is_ours():
    left = 1 - relaxed_share(1.0, fractions=FRACTIONS, times_s=TIMES_S)
    card = PROGRAMMES["febio"].write(MATERIAL, UNITS["m"]).encode()
    viscous = ET.fromstring(card).find(".//material")
    g = {name: float(viscous.find(name).text) for name in ("g0", "g1", "g2", "t1", "t2")}
    after = g["g0"] + sum(g[f"g{i}"] * np.exp(-1 / g[f"t{i}"]) for i in (1, 2))
    assert after == pytest.approx(left) and g["g0"] + g["g1"] + g["g2"] == pytest.approx(1)
    rows = PROGRAMMES["abaqus"].write(MATERIAL, UNITS["m"]).split("TIME=PRONY\n")[1].splitlines()
    shear, volume, tau = np.array([[float(x) for x in row.split(",")] for row in rows]).T
    assert shear.tolist() == volume.tolist()
    assert 1 - shear @ -np.expm1(-1 / tau) == pytest.approx(left)


def interval(value, low, high, verdict="identified", unit="Pa"):
    return {"value": value, "low": low, "high": high, "verdict": verdict, "unit": unit}


def estimate(**changed):
    moduli = {name: interval(25e3, 23e3, 27e3) for name in LABELS}
    moduli["poisson_ratio"] = interval(0.3, 0.22, 0.38, unit="1")
    relaxation = {"relaxation": {"times_s": [0.2, 1.0], "fractions": [0.02, 0.0]}}
    return any_estimate(25e3, 0.3, 2e3) | relaxation | moduli | changed


def write(folder, *found, sensors=("kinect",)):
    """Results of a run: estimates, and the summary that the workflow's own tables make of them."""
    groups = [{"object": "sponge", "sensor": name, "provenance": "own"} for name in sensors]
    for name, one in zip(sensors, found, strict=True):
        path = folder / "results/sponge" / name / "direct.json"
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps(one))
    rows = summary([*direct_rows([], [], groups, found)])
    tables.rounded(rows).to_csv(folder / "results/sponge/summary.csv", index=False)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def export(*more, name="sponge", to="abaqus"):
    return main(["export", name, "--to", to, *more])


@pytest.fixture
def rejected(here, capsys):
    """What a call says that writes nothing: one line."""

    def line_of(*more, **how):
        assert export(*more, **how) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert not list(here.glob("*material*")) and not list(here.glob(".part*"))
        return line

    return line_of


@pytest.mark.parametrize("to, ending", [("felupe", "py"), ("febio", "feb"), ("abaqus", "inp")])
def test_a_card_is_written_and_told(here, capsys, to, ending):
    write(here, estimate())
    assert export(to=to) == 0
    moduli = "E = 25.0 kPa (23.0 to 27.0), identified; nu = 0.30 (0.22 to 0.38), identified"
    assert capsys.readouterr().out == f"sponge-material.{ending}: {moduli}\n"
    text = (here / f"sponge-material.{ending}").read_text()
    assert "E = 25.0 kPa (23.0 to 27.0), identified" in text and "units: " in text
    assert export("--output", "again.txt", to=to) == 0
    assert (here / "again.txt").read_text() == text
    # Terms that take nothing are left out.
    assert to != "abaqus" or text.split("TIME=PRONY\n")[1] == "0.02, 0.02, 0.2\n"


def test_of_two_sensors_or_curves_one_is_chosen(here, capsys, rejected):
    declared = interval(0.45, 0.4461, 0.4539, "assumed", "1")
    other = estimate(youngs_modulus_pa=interval(31e3, 30e3, 32e3), poisson_ratio=declared)
    write(here, estimate(), other, sensors=("kinect", "zed"))
    assert "summary.csv: sensor: expected one of kinect, zed (--sensor), found none" in rejected()
    assert "expected one of kinect, zed, found x" in rejected("--sensor", "x")
    assert export("--sensor", "zed") == 0
    assert re.search("E = 31.0 kPa .*nu = 0.45 ", capsys.readouterr().out)
    (here / "sponge-material.inp").unlink()
    path = here / "results/sponge/summary.csv"
    row = pd.read_csv(path)[:1].assign(sensor="curve", method="curve_table")
    pd.concat([row.assign(capture=name) for name in ("back", "08")]).to_csv(path, index=False)
    assert "expected one of curve/back, curve/08 (--sensor)" in rejected()
    # No direct.json says how a curve relaxes.
    assert export("--sensor", "curve/08") == 0
    assert "VISCOELASTIC" not in (here / "sponge-material.inp").read_text()


def test_an_object_or_a_place_that_is_not_there_is_named(here, rejected):
    expected = "error: results: results: expected those of a run (snakemake), found none"
    assert rejected() == expected
    write(here, estimate())
    for name in ("nix", "results/sponge", "."):
        expected = f"error: results: object: expected one of sponge, found {name}"
        assert rejected(name=name) == expected
    (here / "file").touch()
    assert rejected("--output", "file/card.inp") == "error: file: File exists"
    path = here / "results/sponge/summary.csv"
    pd.read_csv(path).drop(columns="recommended").to_csv(path, index=False)
    assert "summary.csv: columns: expected 'recommended', found none" in rejected()


UNKNOWN = [
    ({"youngs_modulus_pa": interval(25e3, 2e3, 90e3, "not identified")},
     "youngs_modulus_pa: expected one that is determined, found 25.0 kPa (2.0 to 90.0),"
     " not identified"),
    ({"poisson_ratio": interval(0.3, 0.0, 0.49, "not identified", "1")},
     "found 0.30 (0.00 to 0.49), not identified"),
    ({"poisson_ratio": interval(0.49, 0.41, 0.49, "bounded", "1")},
     "found 0.49 (0.41 to 0.49), bounded, at the bound of its range"),
    ({"relaxation": None}, "times_s and fractions, found none"),
    ({"relaxation": {"times_s": [1.0], "fractions": [1.2]}}, "sum to less than 1, found others"),
    ({"relaxation": {"times_s": [1.0], "fractions": ["a"]}},
     "fractions: expected numbers, found others"),
    ({"relaxation": {"times_s": [1.0] * 7, "fractions": [0.01] * 7}},
     "times_s: expected 6 for FEBio at most, found 7"),
]  # fmt: skip


@pytest.mark.parametrize("changed, expected", UNKNOWN)
def test_what_is_not_well_known_is_named_with_its_file(here, rejected, changed, expected):
    write(here, estimate(**changed))
    line = rejected(to="febio")
    assert line.endswith(expected) and line.count("error") == 1
    assert ("summary.csv" in line) == ("relaxation" not in changed)
