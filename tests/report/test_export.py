"""The command ``palpate export``: cards that are read back, and what it rejects in one line."""

import json
import re
import xml.etree.ElementTree as ET

import felupe
import numpy as np
import pandas as pd
import pytest
from made_up import GROUP, estimate, interval
from palpate.__main__ import main
from palpate.estimate.relaxation import relaxed_share
from palpate.modulus import Modulus
from palpate.report import tables
from palpate.report.estimate_rows import direct_rows, summary
from palpate.report.material import PROGRAMMES, UNITS, Material
from palpate.solid.laws import NEO_HOOKEAN

E, NU, FRACTIONS, TIMES_S = 24130.0, 0.31, (0.08, 0.05), (0.2, 5.0)
MODULI = Modulus(**interval(E, 1e3)), Modulus(**interval(NU, 0.06, unit="1"))
MATERIAL = Material("a---b", *MODULI, ("warning: a -- b",), FRACTIONS, TIMES_S)


def of_felupe(material):
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


def read(name, unit):
    """Law of a card, deformation gradient to first Piola-Kirchhoff stress; what is left at 1 s."""
    text, names = PROGRAMMES[name].write(MATERIAL, UNITS[unit]), {}
    if name == "felupe":
        exec(text, names)
        return of_felupe(names["material"]), None
    if name == "febio":
        card = ET.fromstring(text.encode())
        g0, g1, g2, t1, t2 = (
            float(card.find(f".//{key}").text) for key in "g0 g1 g2 t1 t2".split()
        )
        assert g0 + g1 + g2 == pytest.approx(1)
        return of_febio(card.find(".//elastic")), g0 + g1 * np.exp(-1 / t1) + g2 * np.exp(-1 / t2)
    # NEO HOOKE, which is that of another material of FElupe; shear and volume relax alike.
    C10, D1 = map(float, re.search(r"\*HYPERELASTIC, NEO HOOKE.*\n(.+), (.+)\n", text).groups())
    terms = np.loadtxt(text.split("TIME=PRONY\n")[1].splitlines(), delimiter=",")
    left = 1 + terms[:, :2].T @ np.expm1(-1 / terms[:, 2])
    return of_felupe(felupe.NeoHooke(mu=2 * C10, bulk=2 / D1)), left


# Abaqus has another law, with the same E and nu.
@pytest.mark.parametrize("name, strain", [("felupe", 0.2), ("febio", 0.2), ("abaqus", 1e-6)])
@pytest.mark.parametrize("unit, pascals", [("m", 1.0), ("mm", 1e-6)])
def test_a_card_has_our_law_and_relaxation(name, strain, unit, pascals):
    F = np.eye(3) + strain * np.random.default_rng(4).normal(size=(3, 3))
    (law, left), expected = read(name, unit), pascals * E * NEO_HOOKEAN.stress(F, NU)
    error = np.abs(law(F) - expected).max() / np.abs(expected).max()
    assert error < (1e-5 if name == "abaqus" else 1e-8)
    ours = 1 - relaxed_share(1.0, fractions=FRACTIONS, times_s=TIMES_S)
    assert name == "felupe" or left == pytest.approx(ours)


@pytest.fixture
def results(tmp_path, monkeypatch):
    """Write results of two sensors that exclude each other, and the workflow's summary of them."""
    monkeypatch.chdir(tmp_path)

    def write(**changes):
        other = estimate(31e3, 0.45, 1e3, poisson_ratio=interval(0.45, 0.0039, "assumed", "1"))
        found = {"kinect": estimate(25e3, 0.3, 2e3, **changes), "zed": other}
        folder = tmp_path / "results/sponge"
        for name, one in found.items():
            (folder / name).mkdir(parents=True)
            (folder / name / "direct.json").write_text(json.dumps(one))
        groups = [GROUP | {"object": "sponge", "sensor": name} for name in found]
        rows = summary([*direct_rows([], [], groups, found.values())])
        tables.rounded(rows).to_csv(folder / "summary.csv", index=False)
        return folder / "summary.csv"

    return write


def export(given):
    return main(f"export {given}".split())


def test_a_card_is_written_and_told(results, tmp_path, capsys):
    results()
    card = tmp_path / "sponge-material.inp"
    assert export("sponge --to abaqus --sensor kinect") == 0
    moduli = "E = 25.0 kPa (23.0 to 27.0), bounded; nu = 0.30 (0.25 to 0.35), bounded"
    assert capsys.readouterr().out == f"{card.name}: {moduli}\n"
    assert all(one in card.read_text() for one in moduli.split("; "))
    # Terms that take nothing are left out.
    assert card.read_text().split("TIME=PRONY\n")[1] == "0.02, 0.02, 0.2\n"
    assert export("sponge --to abaqus --sensor zed") == 0
    assert re.search("E = 31.0 kPa .*nu = 0.45 ", capsys.readouterr().out)


def test_of_curves_one_is_chosen(results, tmp_path, capsys):
    path = results()
    row = pd.read_csv(path)[:1].assign(sensor="curve", method="curve_table")
    pd.concat([row.assign(capture=name) for name in ("back", "08")]).to_csv(path, index=False)
    assert export("sponge --to abaqus") == 1
    assert "expected one of curve/back, curve/08 (--sensor)" in capsys.readouterr().err
    # No direct.json says how a curve relaxes.
    assert export("sponge --to abaqus --sensor curve/08") == 0
    assert "VISCOELASTIC" not in (tmp_path / "sponge-material.inp").read_text()


OF = "sponge --sensor kinect"
REJECTED = [
    ("sponge --results x", {}, "x: results: expected those of a run (snakemake), found none"),
    (".", {}, "error: results: object: expected one of sponge, found ."),
    ("sponge", {}, "summary.csv: sensor: expected one of kinect, zed (--sensor), found none"),
    ("sponge --sensor x", {}, "summary.csv: sensor: expected one of kinect, zed, found x"),
    (f"{OF} --output results/sponge/summary.csv/a", {}, "summary.csv: File exists"),
    (OF, {"youngs_modulus_pa": interval(25e3, 23e3, "not identified")},
     "summary.csv: youngs_modulus_pa: expected one that is determined, found"
     " 25.0 kPa (2.0 to 48.0), not identified"),
    (OF, {"poisson_ratio": interval(0.3, 0.19, "not identified", "1")},
     "found 0.30 (0.11 to 0.49), not identified"),
    (OF, {"poisson_ratio": interval(0.45, 0.0, "bounded", "1")},
     "found 0.45 (0.45 to 0.45), bounded, at the bound of its range"),
    (OF, {"relaxation": None},
     "direct.json: relaxation: expected times_s and fractions, found none"),
    (OF, {"relaxation": {"times_s": [1.0], "fractions": [1.2]}}, "less than 1, found others"),
    (OF, {"relaxation": {"times_s": [1.0] * 7, "fractions": [0.01] * 7}},
     "times_s: expected 6 for FEBio at most, found 7"),
]  # fmt: skip


@pytest.mark.parametrize("given, changed, expected", REJECTED)
def test_what_is_wrong_is_one_line(results, tmp_path, capsys, given, changed, expected):
    results(**changed)
    assert export(f"{given} --to febio") == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith(expected) and line.count("error") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["results"]
