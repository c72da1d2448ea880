"""Curves of one indentation as instruments of many kinds write them; no two alike."""

from dataclasses import dataclass

import numpy as np

E_STAR_PA, RADIUS_M = 30e3, 0.005
LENGTHS = {"m": 1.0, "mm": 1e3, "µm": 1e6, "nm": 1e9}
FORCES = {"N": 1.0, "mN": 1e3, "nN": 1e9, "gf": 1 / 9.80665e-3}


def indentation(*, retract=False, hold=False, contact_m=4e-4, seed=5):
    """Depth [m] and force [N] of an indentation by Hertz's law, with noise of 1 mN."""
    rng = np.random.default_rng(seed)
    depth = np.linspace(0, 1.4e-3, 281)
    if hold:
        depth = np.r_[depth, np.full(120, depth[281 - 1])]
    count = len(depth)
    if retract:
        depth = np.r_[depth, np.linspace(1.4e-3, 0, 281)[1:]]
    force = 4 / 3 * E_STAR_PA * np.sqrt(RADIUS_M) * np.maximum(depth - contact_m, 0) ** 1.5
    # A softer way back, and what relaxes while it is held.
    force[count:] *= 0.7
    force[281:count] *= 1 - 0.3 * np.linspace(0, 1, max(count - 281, 0))
    return depth, force + 1e-3 * rng.normal(size=len(depth))


# Of which no test changes anything.
DEPTH_M, FORCE_N = indentation()
DEPTH_M.flags.writeable = FORCE_N.flags.writeable = False


def written(folder, header, *columns, mark=",", decimal=".", number="{:.9g}", name="curve.csv"):
    """A file of columns below lines of a header."""
    rows = [mark.join(map(number.format, row)) for row in zip(*columns, strict=True)]
    path = folder / name
    path.write_text("\n".join([header, *(row.replace(".", decimal) for row in rows)]) + "\n")
    return path


@dataclass(frozen=True)
class Manner:
    """How an instrument writes a curve; names and units of depth and force with | between."""

    names: str = "Displacement (mm)|Load (N)"
    units: str = "mm|N"
    delimiter: str = ","
    decimal: str = "."
    before: tuple = ()
    unit_row: str = ""
    comment: str = ""
    signs: tuple = (1, 1)
    time: bool = False
    encoding: str = "utf-8"
    ending: str = "\n"
    retract: bool = False
    hold: bool = False
    number: str = "{:.9g}"
    swapped: bool = False
    after: tuple = ()
    options: str = ""

    def content(self):
        """The file's bytes."""
        length, force = self.units.split("|")
        factors = self.signs[0] * LENGTHS[length], self.signs[1] * FORCES[force]
        way = slice(None, None, -1 if self.swapped else 1)
        depth_and_force = indentation(retract=self.retract, hold=self.hold)
        columns = [one * part for one, part in zip(factors, depth_and_force, strict=True)][way]
        head = [line.split("|")[way] for line in (self.names, self.unit_row) if line]
        if self.time:
            columns.insert(0, np.arange(len(columns[0])) / 50)
            head = [[name, *line] for name, line in zip(("Time (s)", "s"), head, strict=False)]
        lines = [*self.before, *(self.comment + self.delimiter.join(line) for line in head)]
        for row in zip(*columns, strict=True):
            cells = [self.number.format(value).replace(".", self.decimal) for value in row]
            lines.append(self.delimiter.join(cells))
        return "".join(line + self.ending for line in [*lines, *self.after]).encode(self.encoding)


PLAIN = Manner()
MACHINE = tuple(f"Line {k}: operator, sample; date = 2026-11-{k:02}" for k in range(1, 13))
GERMAN = {"delimiter": ";", "decimal": ","}
EXTENSION, ROBOT = "Extension|Load", "Position Z [mm]|Fz [N]"
MANNERS = {
    # Testing machines: a title, time in front, a row of units, either sign.
    "machine": Manner(before=MACHINE, time=True),
    "machine, compression is negative": Manner(before=MACHINE, signs=(-1, -1)),
    "machine, load is negative": Manner(time=True, signs=(1, -1)),
    "machine, way is negative": Manner(signs=(-1, 1)),
    "machine, units row": Manner(EXTENSION, unit_row="mm|N", before=MACHINE[:3], time=True),
    "machine, units in brackets": Manner(EXTENSION, unit_row="(mm)|(N)", before=MACHINE[:6]),
    "machine, quoted": Manner('"Extension (mm)"|"Load (N)"', number='"{:.9g}"'),
    # German ones: semicolons, decimal commas, Windows' letters.
    "german": Manner("Weg [mm]|Kraft [N]", ending="\r\n", **GERMAN),
    "german, latin-1": Manner(
        "Verformung in µm|Kraft in mN", "µm|mN", encoding="latin-1", before=("Prüfer: Größe 5",),
        **GERMAN,
    ),
    "german, units row": Manner(
        "Standardweg|Standardkraft", unit_row="mm|N", options="--depth-column Standardweg", **GERMAN
    ),
    "german, tabs": Manner("Weg mm|Kraft N", delimiter="\t", decimal=","),
    "german, quoted commas": Manner(decimal=",", number='"{:.9g}"'),
    # Spreadsheets: UTF-16 with tabs, marks of UTF-8.
    "unicode text": Manner(delimiter="\t", encoding="utf-16"),
    "unicode text without a mark": Manner(delimiter="\t", encoding="utf-16-le"),
    "marked UTF-8": Manner("Displacement (µm)|Load (mN)", "µm|mN", encoding="utf-8-sig"),
    "semicolon csv": Manner(delimiter=";"),
    "trailing delimiter": Manner(ending=",\n"),
    # Atomic force microscopes and nanoindenters: nm and nN, comments, retract.
    "afm": Manner(
        "Indentation [nm]|Force [nN]", "nm|nN", delimiter="\t", retract=True,
        before=("# instrument: afm", "# columns: 2"),
    ),
    "afm, tip position": Manner("tip_position_m|force_N", "m|N", signs=(-1, 1)),
    "afm, height falls": Manner(
        '"height [m]"|"vDeflection [N]"', "m|N", delimiter=" ", signs=(-1, 1), retract=True,
        comment="# ",
    ),
    "afm, percent": Manner("z (nm)|F (nN)", "nm|nN", comment="% "),
    "nanoindenter": Manner(
        "Disp. Into Surface (nm)|Load On Sample (mN)", "nm|mN", delimiter="\t", swapped=True,
        before=("Test 1", "", "Segment: loading"),
    ),
    # numpy and Matlab: comments or nothing before the numbers.
    "savetxt": Manner("depth_m|force_n", "m|N", delimiter=" ", comment="# ", number="{:.18e}"),
    "no header": Manner(
        "", options="--depth-column 1 --depth-unit mm --force-column 2 --force-unit N"
    ),
    "fortran": Manner("disp_mm|load_n", delimiter=" ", number="{:.9E}"),
    "names without units": Manner("depth|force", options="--depth-unit mm --force-unit N"),
    # Our own, and robots.
    "ours": Manner("depth_m|force_n", "m|N"),
    "ours, both signs": Manner("depth_m|force_n", "m|N", signs=(-1, -1)),
    "robot": Manner(ROBOT, signs=(-1, -1), time=True),
    "robot, with hold": Manner("pos_z (mm)|f_z (N)", hold=True, time=True),
    "robot, hold and retract": Manner(hold=True, retract=True, time=True, signs=(-1, 1)),
    "scale": Manner("Depth (mm)|Load (gf)", "mm|gf"),
    "force first": Manner(swapped=True),
    # Segments, footers, gaps.
    "footer": Manner(after=("", "End of test", "Maximum load: 0.1 N")),
    "blank lines": Manner(before=("", "Test 1", ""), ending="\n\n"),
    "pipes": Manner(delimiter="|"),
    "old mac": Manner(ending="\r"),
    "slash units": Manner("Displacement / mm|Force / N", delimiter="\t"),
    "comma units": Manner("Displacement, mm|Force, N", delimiter="\t"),
    "retract, everything at once": Manner(
        "Weg|Kraft", "mm|mN", unit_row="[mm]|[mN]", signs=(-1, -1), encoding="utf-16",
        before=MACHINE, hold=True, retract=True, time=True, ending="\r\n", **GERMAN,
    ),
}  # fmt: skip
