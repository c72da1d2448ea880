"""Units of lengths and forces as headers write them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

# In metres; letters of either case, since no instrument counts in megametres.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "micron": 1e-6, "microns": 1e-6,
           "nm": 1e-9, "pm": 1e-12, "in": 0.0254, "inch": 0.0254}  # fmt: skip
# In newtons.
FORCES = {"MN": 1e6, "kn": 1e3, "n": 1.0, "cn": 1e-2, "mn": 1e-3, "un": 1e-6, "nn": 1e-9,
          "pn": 1e-12, "kgf": 9.80665, "gf": 9.80665e-3, "kg": 9.80665, "g": 9.80665e-3,
          "lbf": 4.4482216152605}  # fmt: skip
# Stiffnesses in newtons per metre; a bare number is in those, as in files of AFMs.
PER_M = {"1": 1.0, "n/m": 1.0, "mn/m": 1e-3, "nn/nm": 1.0, "pn/nm": 1e-3}
# Of other columns, in a row of units.
OTHERS = {"", "-", "s", "ms", "sec", "min", "v", "mv", "%", "1", "n/m", "hz", "mm/s", "mm/min",
          "pa", "kpa", "mpa", "deg", "\N{DEGREE SIGN}c"}  # fmt: skip
UNIT_LIKE = re.compile(r"[\w%/^*.\N{DEGREE SIGN}-]{0,8}")
MICRO = str.maketrans({"\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u"})
# As people write them, where that is not in small letters.
UNITS = {"um": "\N{MICRO SIGN}m", "kn": "kN", "n": "N", "cn": "cN", "mn": "mN",
         "un": "\N{MICRO SIGN}N", "nn": "nN", "pn": "pN"}  # fmt: skip
# Units that small letters would make others of: a torque a length, meganewtons millinewtons.
CASED = ("Nm", "MN")
# Behind a name: in brackets, after a slash, a comma, "in" or a blank, or as the last part of it.
BEHIND = re.compile(r"^(?P<name>.*?)\s*(?:[\[({<]\s*(?P<a>[^\[\](){}<>]*?)\s*[\])}>]"
                    r"|(?:/|,|\bin\b|\s|_)\s*(?P<b>[^\s\[\]()_/,]+))\s*$")  # fmt: skip
# Of a force beside another: what ends the name of the one, as F_n beside F_t, is no unit.
DIRECTION = re.compile(r"_[a-z]", re.IGNORECASE)


@dataclass(frozen=True)
class Header:
    """Name of a column without its unit; the unit, as `plain` has it, if it is known.

    ``marked`` is what stands in brackets or behind a slash at the end, known or not.
    """

    name: str
    unit: str = ""
    marked: str = ""


def plain(unit: str) -> str:
    """A unit in small letters, without brackets."""
    bare = unit.strip("[](){}<> \t").translate(MICRO)
    return bare if bare in CASED else bare.lower()


def are_units(cells: Sequence[str]) -> bool:
    """Whether cells are a row of units, one of a length or a force among them."""
    found = [plain(cell) for cell in cells]
    length, force = (any(unit in known for unit in found) for known in (LENGTHS, FORCES))
    if all(unit in LENGTHS or unit in FORCES or unit in OTHERS for unit in found):
        return length or force
    # Of others, like mm/mm, no list is whole.
    return length and force and all(map(UNIT_LIKE.fullmatch, found))


def header(text: str, others: Sequence[str] = ()) -> Header:
    """Name and unit of a column, whose header stands among others."""
    found = BEHIND.match(text)
    if not found:
        return Header(text)
    in_brackets = found["a"] is not None
    unit, name, end = found["a"] if in_brackets else found["b"], found["name"], text[found.end(1) :]
    marked = unit if in_brackets or re.match(r"\s+/", end) else ""
    beside = [one[len(name) :] for one in others if one != text and one.startswith(name)]
    index = end.lower() in ("_n", "_g") and (
        (end.islower() and len(name) == 1) or any(map(DIRECTION.fullmatch, beside))
    )
    # Where all is in capitals, MN is mN as likely.
    if plain(unit) == "MN" and "".join([text, *others]).isupper():
        return Header(name, "", unit)
    known = plain(unit) in LENGTHS or plain(unit) in FORCES
    if not known or index or end.lower() == "_in":
        return Header(text, "", marked)
    return Header(name, plain(unit), marked)
