"""Cards of a material for programmes of finite elements: FElupe, FEBio, Abaqus."""

from dataclasses import dataclass

from palpate.report.material import Material, comment
from palpate.report.pages import rendered
from palpate.units import MILLIMETRES

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
    """A programme: the suffix of its files, and how many terms of a Prony series it takes."""

    name: str
    suffix: str
    most_terms: int | None = None

    def write(self, material: Material, units: Units) -> str:
        """Text of a card, by the template of the suffix: Eq. 2.2's law, or the nearest one.

        Ten digits: what is read back differs by less than anything that was measured.

        Raises
        ------
        ValueError
            If the material relaxes in more terms than the programme takes.
        """
        terms = list(zip(material.fractions, material.times_s, strict=True))
        if self.most_terms and len(terms) > self.most_terms:
            expected = f"expected {self.most_terms} for {self.name} at most"
            raise ValueError(f"relaxation.times_s: {expected}, found {len(terms)}")
        lam, mu = (units.modulus * pascals for pascals in material.lame_pa)
        known = {"name": material.name, "law": LAW, "lam": lam, "mu": mu, "terms": terms}
        told = [*comment(material), f"units: {units.told}"]
        return rendered(f"card{self.suffix}.j2", told=told, **known).rstrip() + "\n"


PROGRAMMES = {
    "felupe": Programme("FElupe", ".py"),
    "febio": Programme("FEBio", ".feb", most_terms=6),
    "abaqus": Programme("Abaqus", ".inp"),
}
