"""Curves of one press as ten kinds of instruments write them; no two alike."""

from dataclasses import dataclass, replace

import numpy as np

E_STAR_PA, RADIUS_M = 30e3, 0.005
LENGTHS = {"m": 1.0, "mm": 1e3, "µm": 1e6, "nm": 1e9}
FORCES = {"N": 1.0, "mN": 1e3, "nN": 1e9, "gf": 1 / 9.80665e-3}


def press(*, retract=False, hold=False, contact_m=4e-4, seed=5):
    """Depth [m] and force [N] of a press by Hertz's law, with noise of 1 mN."""
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


@dataclass(frozen=True)
class Manner:
    """How an instrument writes a curve."""

    names: tuple = ("Displacement (mm)", "Load (N)")
    units: tuple = ("mm", "N")
    delimiter: str = ","
    decimal: str = "."
    before: tuple = ()
    unit_row: tuple | None = None
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
    options: tuple = ()

    def text(self):
        """The file's text."""
        depth, force = press(retract=self.retract, hold=self.hold)
        columns = [
            self.signs[0] * LENGTHS[self.units[0]] * depth,
            self.signs[1] * FORCES[self.units[1]] * force,
        ]
        names, units = list(self.names), list(self.unit_row or ())
        if self.swapped:
            columns, names, units = columns[::-1], names[::-1], units[::-1]
        if self.time:
            columns.insert(0, np.arange(len(depth)) / 50)
            names, units = ["Time (s)", *names], ["s", *units]
        rows = [self._cells(row) for row in zip(*columns, strict=True)]
        head = [self.delimiter.join(names)] if names and self.names else []
        head += [self.delimiter.join(units)] if self.unit_row else []
        lines = [*self.before, *(self.comment + line for line in head), *rows, *self.after]
        return self.ending.join(lines) + self.ending

    def _cells(self, row):
        cells = [self.number.format(value).replace(".", self.decimal) for value in row]
        return self.delimiter.join(cells)

    def content(self):
        """The file's bytes."""
        return self.text().encode(self.encoding)


PLAIN = Manner()
MACHINE = tuple(f"Line {k}: operator, sample; date = 2026-11-{k:02}" for k in range(1, 13))
MANNERS = {
    # Testing machines: a title, time in front, a row of units, either sign.
    "machine": replace(PLAIN, before=MACHINE, time=True),
    "machine, compression is negative": replace(PLAIN, before=MACHINE, signs=(-1, -1)),
    "machine, load is negative": replace(PLAIN, time=True, signs=(1, -1)),
    "machine, way is negative": replace(PLAIN, signs=(-1, 1)),
    "machine, units row": replace(
        PLAIN, names=("Extension", "Load"), unit_row=("mm", "N"), before=MACHINE[:3], time=True
    ),
    "machine, units in brackets": replace(
        PLAIN, names=("Extension", "Load"), unit_row=("(mm)", "(N)"), before=MACHINE[:6]
    ),
    "machine, quoted": replace(PLAIN, names=('"Extension (mm)"', '"Load (N)"'), number='"{:.9g}"'),
    # German ones: semicolons, decimal commas, Windows' letters.
    "german": replace(
        PLAIN, names=("Weg [mm]", "Kraft [N]"), delimiter=";", decimal=",", ending="\r\n"
    ),
    "german, latin-1": replace(
        PLAIN,
        names=("Verformung in µm", "Kraft in mN"),
        units=("µm", "mN"),
        delimiter=";",
        decimal=",",
        encoding="latin-1",
        before=("Prüfer: Größe 5",),
    ),
    "german, units row": replace(
        PLAIN,
        names=("Standardweg", "Standardkraft"),
        unit_row=("mm", "N"),
        delimiter=";",
        decimal=",",
        options=("--depth-column", "Standardweg"),
    ),
    "german, tabs": replace(PLAIN, delimiter="\t", decimal=",", names=("Weg mm", "Kraft N")),
    "german, quoted commas": replace(PLAIN, decimal=",", number='"{:.9g}"'),
    # Spreadsheets: UTF-16 with tabs, marks of UTF-8.
    "unicode text": replace(PLAIN, delimiter="\t", encoding="utf-16"),
    "unicode text without a mark": replace(PLAIN, delimiter="\t", encoding="utf-16-le"),
    "marked UTF-8": replace(
        PLAIN, encoding="utf-8-sig", names=("Displacement (µm)", "Load (mN)"), units=("µm", "mN")
    ),
    "semicolon csv": replace(PLAIN, delimiter=";"),
    "trailing delimiter": replace(PLAIN, ending=",\n"),
    # Atomic force microscopes and nanoindenters: nm and nN, comments, retract.
    "afm": replace(
        PLAIN,
        names=("Indentation [nm]", "Force [nN]"),
        units=("nm", "nN"),
        delimiter="\t",
        before=("# instrument: afm", "# columns: 2"),
        retract=True,
    ),
    "afm, tip position": replace(
        PLAIN, names=("tip_position_m", "force_N"), units=("m", "N"), signs=(-1, 1)
    ),
    "afm, height falls": replace(
        PLAIN,
        names=('"height [m]"', '"vDeflection [N]"'),
        units=("m", "N"),
        delimiter=" ",
        signs=(-1, 1),
        retract=True,
        comment="# ",
    ),
    "afm, percent": replace(
        PLAIN, names=("z (nm)", "F (nN)"), units=("nm", "nN"), comment="% ", delimiter=","
    ),
    "nanoindenter": replace(
        PLAIN,
        names=("Disp. Into Surface (nm)", "Load On Sample (mN)"),
        units=("nm", "mN"),
        delimiter="\t",
        swapped=True,
        before=("Test 1", "", "Segment: loading"),
    ),
    # numpy and Matlab: comments or nothing before the numbers.
    "savetxt": replace(
        PLAIN,
        delimiter=" ",
        comment="# ",
        names=("depth_m", "force_n"),
        units=("m", "N"),
        number="{:.18e}",
    ),
    "no header": replace(
        PLAIN,
        names=(),
        options=(
            "--depth-column",
            "1",
            "--depth-unit",
            "mm",
            "--force-column",
            "2",
            "--force-unit",
            "N",
        ),
    ),
    "fortran": replace(PLAIN, delimiter=" ", names=("disp_mm", "load_n"), number="{:.9E}"),
    "names without units": replace(
        PLAIN, names=("depth", "force"), options=("--depth-unit", "mm", "--force-unit", "N")
    ),
    # Our own, and robots.
    "ours": replace(PLAIN, names=("depth_m", "force_n"), units=("m", "N")),
    "ours, both signs": replace(
        PLAIN, names=("depth_m", "force_n"), units=("m", "N"), signs=(-1, -1)
    ),
    "robot": replace(PLAIN, names=("Position Z [mm]", "Fz [N]"), signs=(-1, -1), time=True),
    "robot, with hold": replace(PLAIN, names=("pos_z (mm)", "f_z (N)"), hold=True, time=True),
    "robot, hold and retract": replace(PLAIN, hold=True, retract=True, time=True, signs=(-1, 1)),
    "scale": replace(PLAIN, names=("Depth (mm)", "Load (gf)"), units=("mm", "gf")),
    "force first": replace(PLAIN, swapped=True),
    # Segments, footers, gaps.
    "footer": replace(PLAIN, after=("", "End of test", "Maximum load: 0.1 N")),
    "blank lines": replace(PLAIN, before=("", "Test 1", ""), ending="\n\n"),
    "pipes": replace(PLAIN, delimiter="|"),
    "old mac": replace(PLAIN, ending="\r"),
    "slash units": replace(PLAIN, names=("Displacement / mm", "Force / N"), delimiter="\t"),
    "comma units": replace(PLAIN, names=("Displacement, mm", "Force, N"), delimiter="\t"),
    "retract, everything at once": replace(
        PLAIN,
        names=("Weg", "Kraft"),
        unit_row=("[mm]", "[mN]"),
        units=("mm", "mN"),
        delimiter=";",
        decimal=",",
        signs=(-1, -1),
        encoding="utf-16",
        before=MACHINE,
        hold=True,
        retract=True,
        time=True,
        ending="\r\n",
    ),
}
