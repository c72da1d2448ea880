"""Cards of a material for programmes of finite elements: FElupe, FEBio, Abaqus."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape, quoteattr

from palpate.report.material import Material, comment
from palpate.units import MILLIMETRES

# Terms of a Prony series that FEBio takes.
MOST_TERMS = 6
LAW = "W = mu/2 (I1 - 3) - mu ln J + lam/2 (J - 1)^2"


@dataclass(frozen=True)
class Units:
    """Units of a card: those of moduli, forces, lengths and times, and the factor from pascals."""

    told: str
    modulus: float


UNITS = {
    "m": Units("Pa, N, m, s", 1.0),
    # A newton on a square millimetre is a megapascal.
    "mm": Units("MPa, N, mm, s", MILLIMETRES**-2),
}


@dataclass(frozen=True)
class Programme:
    """How a programme takes materials: the suffix of its files, and what writes a card's text."""

    suffix: str
    write: Callable[[Material, Units], str]


def felupe_card(material: Material, units: Units) -> str:
    """Python file whose ``material`` is Eq. 2.2's: FElupe's law without volume, and the volume's.

    Returns
    -------
    str
        Relaxation stands in it as a comment, for FElupe's materials are elastic.
    """
    lam, mu = _lame(material, units)
    told = [*comment(material), f"units: {units.told}", f"law: {LAW}"]
    if material.fractions:
        terms = ", ".join(f"{g:.4g} at {tau:g} s" for g, tau in _terms(material))
        told.append(f"not in it: relaxation, shares of the modulus that are lost: {terms}")
    head = "".join(f"# {line}\n" for line in told)
    return (
        f"{head}import felupe\n\nlam = {_number(lam)}\nmu = {_number(mu)}\n"
        "material = felupe.NeoHookeCompressible(mu=mu) & felupe.Volumetric(bulk=lam)\n"
    )


def febio_card(material: Material, units: Units) -> str:
    """XML file with one material, Ogden's unconstrained one whose first term is Eq. 2.2's.

    Its energy is cp/2 (J - 1)^2 + c1/m1^2 (sum of the stretches to the power m1 - 3 - m1 ln J),
    so c1 = 2 mu, m1 = 2, cp = lam. FEBio's own "neo-Hookean" has lam/2 (ln J)^2 in its place.

    Raises
    ------
    ValueError
        If the material relaxes in more terms than FEBio takes.
    """
    if len(material.fractions) > MOST_TERMS:
        found = f"found {len(material.fractions)}"
        raise ValueError(f"relaxation.times_s: expected {MOST_TERMS} for FEBio at most, {found}")
    lam, mu = _lame(material, units)
    told = [*comment(material), f"units: {units.told}", f"law: {LAW}", "density: not measured"]
    named = f'id="1" name={quoteattr(material.name)}'
    law = [f"<c1>{_number(2 * mu)}</c1>", "<m1>2</m1>", f"<cp>{_number(lam)}</cp>"]
    kind, inside = "Ogden unconstrained", law
    if material.fractions:
        told.append("relaxation of the whole stress, at constant nu; at once it is the law's")
        kind, inside = "viscoelastic", _febio_terms(material, kind, law)
    body = ["  <Material>", f'    <material {named} type="{kind}">']
    body += [f"      {line}" for line in inside] + ["    </material>", "  </Material>"]
    # Two hyphens would end the comment.
    head = [f"  {re.sub('-(?=-)', '- ', escape(line))}" for line in told]
    first = '<?xml version="1.0" encoding="UTF-8"?>'
    whole = [first, "<!--", *head, "-->", '<febio_spec version="4.0">', *body, "</febio_spec>", ""]
    return "\n".join(whole)


def abaqus_card(material: Material, units: Units) -> str:
    """Keywords of a material whose law is nearest: C10 (I1 J^(-2/3) - 3) + (J - 1)^2 / D1.

    C10 = mu/2 and D1 = 2/K with K = lam + 2 mu/3 make it Eq. 2.2's at small strain.
    """
    lam, mu = _lame(material, units)
    bulk = lam + 2 * mu / 3
    told = [*comment(material), f"units: {units.told}", f"law measured with: {LAW}"]
    told += ["law of this card: C10 (I1 J^(-2/3) - 3) + (J - 1)^2 / D1, C10 = mu/2, D1 = 2/K:"]
    told += ["the same at small strain alone; shortened by a fifth up to a tenth stiffer"]
    volume = f"{_number(mu / 2)}, {_number(2 / bulk)}"
    lines = [f'*MATERIAL, NAME="{material.name}"']
    if not material.fractions:
        lines += ["*HYPERELASTIC, NEO HOOKE", volume]
    else:
        told.append("relaxation: shear and volume lose the same shares, so that nu is constant")
        lines += ["*HYPERELASTIC, NEO HOOKE, MODULI=INSTANTANEOUS", volume]
        lines += ["*VISCOELASTIC, TIME=PRONY"]
        lines += [f"{_number(g)}, {_number(g)}, {_number(tau)}" for g, tau in _terms(material)]
    return "\n".join([*(f"** {line}" for line in told), *lines, ""])


PROGRAMMES = {
    "felupe": Programme(".py", felupe_card),
    "febio": Programme(".feb", febio_card),
    "abaqus": Programme(".inp", abaqus_card),
}


def _febio_terms(material: Material, kind: str, law: Sequence[str]) -> list[str]:
    lines = [f"<g0>{_number(1 - sum(material.fractions))}</g0>"]
    for place, (g, tau) in enumerate(_terms(material), 1):
        lines += [f"<g{place}>{_number(g)}</g{place}>", f"<t{place}>{_number(tau)}</t{place}>"]
    return [*lines, f'<elastic type="{kind}">', *(f"  {line}" for line in law), "</elastic>"]


def _terms(material: Material) -> Iterator[tuple[float, float]]:
    return zip(material.fractions, material.times_s, strict=True)


def _lame(material: Material, units: Units) -> tuple[float, float]:
    lam_pa, mu_pa = material.lame_pa
    return units.modulus * lam_pa, units.modulus * mu_pa


def _number(value: float) -> str:
    """Ten digits: what is read back differs by less than anything that was measured."""
    return f"{value:.10g}"
