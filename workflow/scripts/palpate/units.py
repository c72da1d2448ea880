"""Factors from SI units to those that people read, and constants."""

import math

MILLIMETRES, CENTIMETRES, CUBIC_CENTIMETRES = 1e3, 1e2, 1e6
# Metres in a unit of files.
METRES = {"m": 1.0, "mm": 0.001}
KILOPASCALS, MILLINEWTONS, MILLISECONDS = 1e-3, 1e3, 1e3
PERCENT = 100.0
GRAVITY_M_S2 = 9.81
# Normal distribution: standard deviation over median absolute deviation.
FROM_MEDIAN = 1.4826

_PREFIXES = {-12: "p", -9: "n", -6: "\N{MICRO SIGN}", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


def readable(largest: float, unit: str) -> tuple[float, str]:
    """Factor from an SI unit to the one in which a size is read best, and that unit.

    Lengths are told from a tenth of a unit on, others from one.

    >>> readable(0.0021, "m"), readable(7.3e4, "Pa")
    ((1000.0, 'mm'), (0.001, 'kPa'))
    """
    least = 0.1 if unit == "m" else 1.0
    power = 3 * math.floor(math.log10(abs(largest) / least) / 3) if largest else 0
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    return 10.0**-power, f"{_PREFIXES[power]}{unit}"
