"""Cards are read back: by FElupe itself, and by the laws that FEBio and Abaqus say they have."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import felupe
import numpy as np
import pytest
from palpate.estimate.relaxation import relaxed_share
from palpate.modulus import Modulus
from palpate.report.material import Material
from palpate.report.material_cards import PROGRAMMES, UNITS
from palpate.solid.laws import NEO_HOOKEAN
from scipy.optimize import brentq

E, NU = 24130.0, 0.31
FRACTIONS, TIMES_S = (0.08, 0.05), (0.2, 5.0)
SMALL = 1e-6
MATERIAL = Material(
    "sponge",
    Modulus(E, 23000.0, 25500.0, "identified", "Pa"),
    Modulus(NU, 0.25, 0.37, "identified", "1"),
    ("doubtful: a -- b",),
    FRACTIONS,
    TIMES_S,
)
STRETCHED = np.eye(3) + 0.2 * np.random.default_rng(4).normal(size=(3, 3))
UNIAXIAL = np.diag([1 + SMALL, 1 - NU * SMALL, 1 - NU * SMALL])


def card(name, *, unit="m", material=MATERIAL):
    return PROGRAMMES[name].write(material, UNITS[unit])


def of_felupe(text):
    """Law (deformation gradient to first Piola-Kirchhoff stress) of a card that was run."""
    names = {}
    exec(text, names)
    return stress_of(names["material"])


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


def of_abaqus(text):
    """Law of Abaqus' NEO HOOKE, which is that of another material of FElupe."""
    keyword = r"\*HYPERELASTIC, NEO HOOKE.*\n(.+), (.+)\n"
    C10, D1 = map(float, re.search(keyword, text).groups())
    return stress_of(felupe.NeoHooke(mu=2 * C10, bulk=2 / D1))


def law_of(name, **how):
    text = card(name, **how)
    if name == "febio":
        return of_febio(ET.fromstring(text.encode()).find(".//elastic"))
    return {"felupe": of_felupe, "abaqus": of_abaqus}[name](text)


@pytest.mark.parametrize("unit, pascals", [("m", 1.0), ("mm", 1e-6)])
@pytest.mark.parametrize("name", PROGRAMMES)
def test_small_strain_gives_e_and_nu(name, unit, pascals):
    P = law_of(name, unit=unit)(UNIAXIAL)
    assert P[0, 0] == pytest.approx(pascals * E * SMALL, rel=1e-5)
    # Free sides: nu is that of the card.
    assert abs(P[1, 1]) < 1e-4 * P[0, 0]


@pytest.mark.parametrize("name", ["felupe", "febio"])
def test_at_finite_strain_the_law_is_our_own(name):
    expected = E * NEO_HOOKEAN.stress(STRETCHED, NU)
    np.testing.assert_allclose(law_of(name)(STRETCHED), expected, rtol=1e-8, atol=1e-8 * E)


def shortened(law, stretch=0.8):
    """Stress along a bar whose sides are free."""
    side = brentq(lambda side: law(np.diag([stretch, side, side]))[1, 1], 0.9, 1.4)
    return law(np.diag([stretch, side, side]))[0, 0]


@pytest.mark.parametrize("nu", [0.05, 0.15, 0.25, 0.35, 0.45])
def test_abaqus_law_is_stiffer_as_its_card_says(nu):
    material = Material("sponge", MATERIAL.youngs_modulus, Modulus(nu, 0.0, 0.5, "bounded", "1"))
    ours = shortened(lambda F: E * NEO_HOOKEAN.stress(F, nu))
    assert 1.0 < shortened(law_of("abaqus", material=material)) / ours < 1.1
    assert "shortened by a fifth up to a tenth stiffer" in card("abaqus", material=material)


def test_relaxation_of_febio_and_abaqus_is_ours():
    left = 1 - relaxed_share(1.0, fractions=FRACTIONS, times_s=TIMES_S)
    viscous = ET.fromstring(card("febio").encode()).find(".//material")
    assert viscous.get("type") == "viscoelastic"
    g = {name: float(viscous.find(name).text) for name in ("g0", "g1", "g2", "t1", "t2")}
    after = g["g0"] + sum(g[f"g{i}"] * np.exp(-1 / g[f"t{i}"]) for i in (1, 2))
    assert after == pytest.approx(left) and g["g0"] + g["g1"] + g["g2"] == pytest.approx(1)
    text = card("abaqus")
    assert "NEO HOOKE, MODULI=INSTANTANEOUS" in text
    rows = text.split("TIME=PRONY\n")[1].strip().splitlines()
    shear, volume, tau = np.array([[float(x) for x in row.split(",")] for row in rows]).T
    assert shear.tolist() == volume.tolist()
    assert 1 - shear @ -np.expm1(-1 / tau) == pytest.approx(left)
    assert "relaxation" in card("felupe")


def test_without_relaxation_the_cards_are_elastic():
    material = Material("sponge", MATERIAL.youngs_modulus, MATERIAL.poisson_ratio)
    febio = ET.fromstring(card("febio", material=material).encode()).find(".//material")
    assert febio.get("type") == "Ogden unconstrained"
    assert "VISCOELASTIC" not in card("abaqus", material=material)
    assert "INSTANTANEOUS" not in card("abaqus", material=material)


@pytest.mark.parametrize("name", PROGRAMMES)
def test_intervals_units_and_law_stand_in_the_comment(name):
    text = card(name, unit="mm")
    assert "E = 24.1 kPa (23.0 to 25.5), identified" in text
    assert "nu = 0.31 (0.25 to 0.37)" in text
    assert "units: MPa, N, mm, s" in text and "mu ln J" in text


def test_febio_takes_no_more_than_six_terms_and_a_name_of_hyphens():
    many = replace(MATERIAL, fractions=(0.01,) * 7, times_s=(1.0,) * 7)
    with pytest.raises(ValueError, match="times_s: expected 6 for FEBio at most, found 7"):
        card("febio", material=many)
    text = card("febio", material=replace(MATERIAL, name="a---b"))
    assert ET.fromstring(text).find(".//material") is not None
