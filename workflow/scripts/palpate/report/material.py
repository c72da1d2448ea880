"""The material of an object's recommended estimate, and its cards for FElupe, FEBio and Abaqus."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.json_fields import numbers_of, read_fields
from palpate.modulus import ASSUMED, AT_BOUND, BOUNDED, IDENTIFIED, INTERVAL, VERDICTS, Modulus
from palpate.report.pages import rendered
from palpate.solid.laws import lame_from_engineering
from palpate.units import MILLIMETRES

# Verdicts with which Young's modulus is a number to compute with.
TOLD = (IDENTIFIED, BOUNDED, INTERVAL)
KNOWN_BEFORE = "a ratio that is known beforehand is declared by direct.fit.poisson_ratio"
LAW = "W = mu/2 (I1 - 3) - mu ln J + lam/2 (J - 1)^2"


@dataclass(frozen=True)
class Material:
    """Neo-Hookean material (Eq. 2.2) of an object, with what is known of it.

    Attributes
    ----------
    name : str
        Object.
    youngs_modulus, poisson_ratio : Modulus
        Of small strain; E is that of the first moment where the material relaxes.
    notes : tuple of str
        Where the numbers come from, which law they are of and what warnings there are.
    fractions, times_s : tuple of float
        Share of the modulus that each term of the Prony series loses, and its time [s]; shares
        that are zero are left out.
    """

    name: str
    youngs_modulus: Modulus
    poisson_ratio: Modulus
    notes: tuple[str, ...] = ()
    fractions: tuple[float, ...] = ()
    times_s: tuple[float, ...] = ()

    @property
    def lame_pa(self) -> tuple[float, float]:
        """Lame parameters (lam, mu) [Pa]."""
        return lame_from_engineering(self.youngs_modulus.value, self.poisson_ratio.value)


def recommended_row(summary: pd.DataFrame, sensor: str | None = None) -> pd.Series:
    """The row of a summary that says E and nu of its object.

    A sensor is needed where there are several recommended estimates; of curves, which are estimated
    each for itself, ``curve/<capture>`` where there is more than one.

    Raises
    ------
    ValueError
        If there is none, or more than one.
    """
    rows = summary[summary["recommended"].fillna(False).astype(bool)]
    there = names_of(rows)
    if not there:
        raise ValueError("recommended: expected an estimate of E and nu, found none")
    if sensor is None and len(there) > 1:
        raise ValueError(f"sensor: expected one of {', '.join(there)} (--sensor), found none")
    if sensor is not None and sensor not in there:
        raise ValueError(f"sensor: expected one of {', '.join(there)}, found {sensor}")
    return rows.iloc[0 if sensor is None else there.index(sensor)]


def names_of(rows: pd.DataFrame) -> list[str]:
    """What recommended rows of an object are called: by sensor, several curves by capture too."""
    alike = rows["sensor"].duplicated(keep=False)
    return list(rows["sensor"].where(~alike, rows["sensor"] + "/" + rows["capture"]))


def material_of(row: pd.Series, estimate: Path | None = None) -> Material:
    """Material of a recommended row (`recommended_row`).

    The direct.json that the row is of, where there is one, holds the relaxation.

    Raises
    ------
    ValueError
        If Young's modulus or Poisson's ratio is not determined, or the file is damaged.
    """
    E, nu = (Modulus.of_row(row, name) for name in ("youngs_modulus_pa", "poisson_ratio"))
    if E is None or E.verdict not in TOLD:
        found = "none" if E is None else str(E)
        raise ValueError(f"youngs_modulus_pa: expected one that is determined, found {found}")
    _check_ratio(nu)
    fractions, times_s = _relaxation(estimate) if estimate else ((), ())
    return Material(row["object"], E, nu, _notes(row), fractions, times_s)


def _comment(material: Material) -> list[str]:
    """What stands at the head of a card: the numbers with their intervals, and the notes."""
    moduli = {"E": material.youngs_modulus, "nu": material.poisson_ratio}
    lines = [f"{name} = {one}: {VERDICTS[one.verdict]}" for name, one in moduli.items()]
    return [f"{material.name}, measured with Palpate", *lines, *material.notes]


def _check_ratio(nu: Modulus | None) -> None:
    """The bulk modulus of a card hangs on nu: one that is not told must not get into it."""
    expected = f"expected one that is told ({KNOWN_BEFORE})"
    if nu is None or nu.low is None or nu.verdict not in VERDICTS:
        raise ValueError(f"poisson_ratio: {expected}, found none")
    if nu.verdict == ASSUMED:
        return
    if nu.verdict not in TOLD:
        raise ValueError(f"poisson_ratio: {expected}, found {nu}")
    # Intervals are cut at the range's ends, so a value at one of those is at its interval's.
    if min(nu.value - nu.low, nu.high - nu.value) < AT_BOUND:
        raise ValueError(f"poisson_ratio: {expected}, found {nu}, at the bound of its range")


def _relaxation(path: Path) -> tuple[tuple[float, ...], tuple[float, ...]]:
    fields = read_fields(path).get("relaxation")
    if not isinstance(fields, Mapping) or not isinstance(fields.get("times_s"), Sequence):
        raise ValueError(f"{path}: relaxation: expected times_s and fractions, found none")
    shape = (len(fields["times_s"]),)
    tau, g = (numbers_of(path, fields, name, shape) for name in ("times_s", "fractions"))
    if not (np.all(tau > 0) and np.all(g >= 0) and g.sum() < 1):
        expected = "positive times and fractions from 0 that sum to less than 1"
        raise ValueError(f"{path}: relaxation: expected {expected}, found others")
    seen = g > 0
    return tuple(g[seen].tolist()), tuple(tau[seen].tolist())


def _notes(row: pd.Series) -> tuple[str, ...]:
    notes = [f"estimate: {row['method']}, {row['sensor']}, provenance {row['provenance']}"]
    notes += ["intervals of 95 %; E and nu are those of small strain"]
    if pd.notna(row.get("force_law")):
        law = f"{row['force_law']:+.2f} +- {row['force_law_std']:.2f}"
        notes.append(f"law of the force: {law} (0: neo-Hooke's, as here; 1: Blatz and Ko's)")
    effective = Modulus.of_row(row, "effective_reduced_modulus_pa")
    if effective is not None and pd.notna(row.get("effective_depth_m")):
        depth = f"{1e3 * row['effective_depth_m']:.1f} mm"
        equal = f"of a neo-Hookean solid of the same force at {depth}, after 1 s"
        notes.append(f"effective E* = {effective}: {equal}")
    warnings = row.get("warnings")
    return (*notes, *([f"warning: {warnings}"] if pd.notna(warnings) else []))


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
        told = [*_comment(material), f"units: {units.told}"]
        return rendered(f"card{self.suffix}.j2", told=told, **known).rstrip() + "\n"


PROGRAMMES = {
    "felupe": Programme("FElupe", ".py"),
    "febio": Programme("FEBio", ".feb", most_terms=6),
    "abaqus": Programme("Abaqus", ".inp"),
}
