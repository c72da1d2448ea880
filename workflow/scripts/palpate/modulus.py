"""A modulus: value, 95 % interval and verdict; which words verdicts have."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import pandas as pd

from palpate.units import readable

IDENTIFIED, BOUNDED, NOT_IDENTIFIED = "identified", "bounded", "not identified"
INTERVAL, NOT_JUDGED, ASSUMED = "interval", "not judged", "assumed"
# All verdicts, the best first, and what they say.
VERDICTS = {
    IDENTIFIED: "the captures determine it",
    BOUNDED: "the captures leave a wide interval, or one end of it open: trust the interval, not"
    " the value; where a warning speaks against the estimate, trust neither",
    NOT_IDENTIFIED: "the captures do not determine it: any value of the range explains them",
    INTERVAL: "it has an interval; whether that is narrow is not judged",
    NOT_JUDGED: "no interval can be given or trusted: a number to compare, not to rely on",
    ASSUMED: "as it was declared: what was recorded determines hardly more",
}
# Moduli of a recommended estimate, what depends least on models and extrapolation first.
LABELS = {
    "effective_reduced_modulus_pa": "effective E*",
    "youngs_modulus_pa": "instantaneous E",
    "youngs_modulus_1s_pa": "E at 1 s",
    "poisson_ratio": "nu",
    "reduced_modulus_pa": "E*",
}
# Of all intervals.
CONFIDENCE = 0.95
# An interval of nu narrower than this tells materials apart: cork, foam, rubber.
NARROW_NU = 0.2
# And one of E that is not wider than by this factor from end to end.
NARROW_E = 1.5
# Ends of an interval of nu this close to the range's are at its bound.
AT_BOUND = 0.005


@dataclass(frozen=True)
class Modulus:
    """Value of an elastic modulus or of Poisson's ratio, and how well it is known.

    Attributes
    ----------
    value : float
    low, high : float or None
        Ends of its interval at 95 %, if it has one; without an upper end it is open.
    verdict : str
        Of `VERDICTS`.
    unit : {"Pa", "1"}
    """

    value: float
    low: float | None
    high: float | None
    verdict: str
    unit: str

    def text(self) -> str:
        """Value and interval, in the unit in which the value is read best.

        >>> Modulus(24130.0, 23000.0, 25500.0, "identified", "Pa").text()
        '24.1 kPa (23.0 to 25.5)'
        >>> Modulus(24130.0, 23000.0, None, "bounded", "Pa").text()
        '24.1 kPa (23.0 kPa or more)'
        """
        scale, unit = readable(self.value, "Pa") if self.unit == "Pa" else (1.0, "")
        places = 1 if unit else 2
        text = f"{scale * self.value:.{places}f} {unit}".strip()
        if self.low is None:
            return text
        if self.high is None:
            # The value may be many times the end.
            end = Modulus(self.low, None, None, self.verdict, self.unit).text()
            return f"{text} ({end} or more)"
        return f"{text} ({scale * self.low:.{places}f} to {scale * self.high:.{places}f})"

    def __str__(self) -> str:
        return f"{self.text()}, {self.verdict}"

    def cells(self, name: str) -> dict[str, float | str | None]:
        """Its columns in a table, under the name of its value's."""
        return dict(
            zip(columns(name), (self.value, self.low, self.high, self.verdict), strict=True)
        )

    @staticmethod
    def of_pascals(value: float, low: float, high: float) -> "Modulus":
        """Judge the interval of a modulus [Pa]."""
        return Modulus(value, low, high, IDENTIFIED if high / low <= NARROW_E else BOUNDED, "Pa")

    @staticmethod
    def of_row(row: Mapping, name: str) -> "Modulus | None":
        """Modulus of a table's row, None where it has none."""
        value, low, high, verdict = (
            None if pd.isna(row.get(column)) else row[column] for column in columns(name)
        )
        unit = "Pa" if name.endswith("_pa") else "1"
        return None if value is None else Modulus(value, low, high, verdict or "", unit)


def modulus_text(value_pa: float, interval_pa: tuple[float, float]) -> str:
    """A modulus with its interval of 95 %, in the unit that it is read best in."""
    scale, unit = readable(value_pa, "Pa")
    low, high = (scale * end for end in interval_pa)
    return f"{scale * value_pa:.4g} {unit} (95 %: {low:.4g} to {high:.4g})"


def bounded_at_best(moduli: Mapping[str, Modulus]) -> dict[str, Modulus]:
    """Moduli of which none is identified."""
    return {
        name: replace(one, verdict=BOUNDED) if one.verdict == IDENTIFIED else one
        for name, one in moduli.items()
    }


def columns(name: str) -> tuple[str, str, str, str]:
    """Columns of a modulus: value, ends of the interval, and verdict.

    >>> columns("youngs_modulus_pa")[1:]
    ('youngs_modulus_low_pa', 'youngs_modulus_high_pa', 'youngs_modulus_verdict')
    """
    stem = name.removesuffix("_pa")
    unit = name[len(stem) :]
    return name, f"{stem}_low{unit}", f"{stem}_high{unit}", f"{stem}_verdict"


def verdict_of_nu(low: float, high: float, bounds: Sequence[float]) -> str:
    """Inside the range and narrow; reaching one end of it, or wide; reaching both."""
    at_low, at_high = low <= bounds[0] + AT_BOUND, high >= bounds[1] - AT_BOUND
    if at_low and at_high:
        return NOT_IDENTIFIED
    if at_low or at_high or high - low > NARROW_NU:
        return BOUNDED
    return IDENTIFIED


def verdicts_in(table: pd.DataFrame) -> list[str]:
    """Verdicts that a table's moduli have, the best first."""
    there = table.columns.intersection([columns(name)[-1] for name in LABELS])
    given = set(table[there].to_numpy().ravel())
    return [verdict for verdict in VERDICTS if verdict in given]
