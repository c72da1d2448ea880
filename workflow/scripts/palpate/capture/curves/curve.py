"""One curve of force against depth, of a file as an instrument wrote it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.capture.curves.columns import (
    DEPTH,
    FORCE,
    Asked,
    Found,
    asked_column,
    column_of,
    is_tips,
    numbers_of,
)
from palpate.capture.curves.export import Export, read_export
from palpate.capture.curves.phases import Phases, outlier, phases_of, signs_of
from palpate.yaml_files import one_line

FEWEST_SAMPLES = 5
# More rows without a number are another table than was thought.
MOST_LEFT_OUT, FEW_LEFT_OUT = 0.5, 0.02
# What a file's preamble states and what is given differ by no more than rounding.
SAME = 0.01
# A record whose deepest sample is among this part of its first ones runs backwards.
BEGINS = 0.05
NAMES = ("depth", "force")


@dataclass(frozen=True)
class Curve:
    """A record of depth and force.

    Attributes
    ----------
    path : str
        Of the file.
    depth_m, force_n : (n,) arrays
        Depth of the tip, as far as it is known, from any zero [m], growing into the object, and
        force [N], growing in the press; in the order of the record.
    chosen : (k,) int array
        Samples of approach and loading that are in range and have weight.
    weights : (k,) array or None
        Of them.
    phases : Phases
    depth_sign : int
        Of ``depth_m`` against the file's column.
    read : str
        How the file was read, in words.
    doubts : tuple of str
        What of that may be otherwise, a line each.
    """

    path: str
    depth_m: NDArray
    force_n: NDArray
    chosen: NDArray
    weights: NDArray | None
    phases: Phases
    depth_sign: int
    read: str
    doubts: tuple[str, ...]

    def loading(self) -> tuple[NDArray, NDArray]:
        """Depth [m] and force [N] of approach and loading, as far as they are chosen, (k,) each."""
        return self.depth_m[self.chosen], self.force_n[self.chosen]

    def __repr__(self) -> str:
        return f"Curve({self.path}: {self.read})"


def read_curve(
    path: str | Path,
    *,
    depth_column: str | None = None,
    force_column: str | None = None,
    depth_unit: str | None = None,
    force_unit: str | None = None,
    weights_column: str | None = None,
    range_m: tuple[float, float] | None = None,
    stiffness_n_m: float | None = None,
    radius_m: float | None = None,
) -> Curve:
    r"""Read a curve.

    Parameters
    ----------
    path : path
        Text table with columns of depth and force; ``-`` is standard input.
    depth_column, force_column : str, optional
        Name or number (from 1), where the header does not tell it.
    depth_unit, force_unit : str, optional
        Like mm, mN; the header's by default.
    weights_column : str, optional
        Column of the samples' weights.
    range_m : (float, float), optional
        Least and greatest value of the depth's column that are used [m], as the file counts.
    stiffness_n_m : float, optional
        Of what gives way between the drive and the tip, such as a cantilever [N/m]: what it bends
        is taken off a depth whose column is not named as the tip's.
    radius_m : float, optional
        Of the indenter: a warning says where the file states another, as with the stiffness.

    Raises
    ------
    ValueError
        Naming file, column and remedy, if it is no curve.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> rows = [f"{-0.1 * k:.1f};{0.02 * max(k - 9, 0) ** 1.5:.3f}" for k in range(30)]
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "curve.txt")
    ...     _ = path.write_text("\n".join(["Travel (mm);Load (N)", *rows]).replace(".", ","))
    ...     curve = read_curve(path)
    >>> print(curve.read.partition(", depth")[0])
    ; as delimiter, decimal commas
    >>> depth_m, force_n = curve.loading()
    >>> print(f"{1e3 * depth_m[-1]:.1f} mm, {force_n[-1]:.2f} N")
    2.9 mm, 1.79 N
    """
    given = {"radius_m": radius_m, "stiffness_n_m": stiffness_n_m}
    for name, value in given.items():
        if value is not None and not 0 < value < np.inf:
            raise ValueError(f"{name}: expected above 0, found {value}")
    export = read_export(path)
    asked = Asked(depth_column, depth_unit), Asked(force_column, force_unit)
    record = _record(export, *asked, weights_column, range_m, stiffness_n_m)
    phases = phases_of(record.depth_m, record.force_n)
    bent_m, read, doubts = _bent(record, stiffness_n_m)
    doubts += tuple(_contradictions(export.stated, given))
    spring = export.stated.get("stiffness_n_m")
    if spring and stiffness_n_m is None and not record.of_tip:
        line = f"the file states a spring of {spring:g} N/m: --stiffness-n-m takes it off"
        doubts += (f"{line}, if {record.depth.name} is the drive's way",)
    chosen = np.arange(len(record.used))[phases.loading]
    chosen = chosen[record.used[chosen]]
    _check_loading(export.path, chosen, len(record.used))
    return Curve(
        path=export.path,
        depth_m=record.depth_m - bent_m,
        force_n=record.force_n,
        chosen=chosen,
        weights=None if record.weights is None else record.weights[chosen],
        phases=phases,
        depth_sign=record.signs[0],
        read=", ".join([*record.read, *read, _phases_told(phases, len(record.used))]),
        doubts=(*record.doubts, *doubts, *_doubts_of_phases(phases)),
    )


@dataclass(frozen=True)
class _Record:
    """Columns of a curve with their signs, which samples are used, and how all that was read."""

    depth_m: NDArray
    force_n: NDArray
    weights: NDArray | None
    used: NDArray
    signs: tuple[int, int]
    depth: Found
    of_tip: bool
    read: tuple[str, ...]
    doubts: tuple[str, ...]

    def turned(self) -> "_Record":
        """The same from its last row to its first."""
        names = ("depth_m", "force_n", "weights", "used")
        rows = {name: getattr(self, name) for name in names}
        return replace(self, **{name: one[::-1] for name, one in rows.items() if one is not None})


def _record(
    export: Export,
    depth: Asked,
    force: Asked,
    weights_column: str | None,
    range_m: tuple[float, float] | None,
    stiffness_n_m: float | None,
) -> _Record:
    position, of_depth = column_of(export, DEPTH, depth)
    load, of_force = column_of(export, FORCE, force)
    extra = [asked_column(export, weights_column, "--weights")] if weights_column else []
    columns, left_out = numbers_of([position, load, *extra])
    _check_samples(export.path, columns, left_out)
    signs, plain = signs_of(*columns[:2])
    of_tip = of_depth.of_tip
    if stiffness_n_m and not of_tip:
        of_tip = is_tips(export, signs[0] * position, signs[1] * load, stiffness_n_m)
    used = _within(export.path, columns[0], range_m)
    read = [*export.read, of_depth.text, of_force.text]
    read += [f"{name} sign turned" for name, sign in zip(NAMES, signs, strict=True) if sign < 0]
    read += [f"{left_out} rows without a number left out"] if left_out else []
    read += [f"{used.sum()} of {len(used)} samples in range"] if not used.all() else []
    depth_m, force_n = signs[0] * columns[0], signs[1] * columns[1]
    backwards = bool(np.argmax(depth_m) < BEGINS * len(depth_m) and depth_m[0] > depth_m[-1])
    doubts = [*export.doubts, *of_depth.doubts, *of_force.doubts]
    doubts += _doubts(plain, backwards, left_out / (left_out + len(used)))
    used &= columns[2] > 0 if extra else True
    weights = columns[2] if extra else None
    told = of_depth, of_tip, tuple(read), tuple(doubts)
    record = _Record(depth_m, force_n, weights, used, signs, *told)
    return record.turned() if backwards else record


def _bent(
    record: _Record, stiffness_n_m: float | None
) -> tuple[NDArray | float, tuple[str, ...], tuple[str, ...]]:
    """Way of the drive that is not the tip's [m]; how it was found, and what may be otherwise."""
    name = record.depth.name
    if stiffness_n_m is None:
        line = (
            f"{name} is the way of the drive, not of the tip: what gives way between them counts as"
            " the object (--stiffness-n-m takes it off)"
        )
        return 0.0, (), (line,) * record.depth.of_drive
    if record.of_tip:
        line = (
            f"{name} is the tip's own depth: --stiffness-n-m takes nothing off it (if it is the"
            " drive's, rename the column)"
        )
        return 0.0, (), (line,)
    bent_m, way_m = float(np.ptp(record.force_n)) / stiffness_n_m, float(np.ptp(record.depth_m))
    if bent_m > way_m:
        found = f"one that gives way by {bent_m:.3g} m (is {name} the tip's own, or it another?)"
        expected = f"expected a spring that gives way by less than the depth's {way_m:.3g} m"
        raise ValueError(f"--stiffness-n-m: {expected}, found {found}")
    bent = f"force over {stiffness_n_m:g} N/m taken off the depth"
    return record.force_n / stiffness_n_m, (bent,), ()


def _contradictions(
    stated: Mapping[str, float], given: Mapping[str, float | None]
) -> Iterator[str]:
    """What a file states otherwise than it is given, a line each."""
    for name, value in given.items():
        there = stated.get(name, value)
        if value is not None and abs(there / value - 1) > SAME:
            yield f"the file states {name} {there:.4g}, where {value:.4g} was given"


def _doubts(plain: bool, backwards: bool, left_out: float) -> Iterator[str]:
    """What of the columns may be otherwise, a line each."""
    if backwards:
        yield "the record begins at its deepest, as a retract does: its rows were turned"
    elif not plain:
        yield (
            "which end of the record is free is not plain (a force that softens?): it is taken to"
            " begin free"
        )
    if left_out > FEW_LEFT_OUT:
        yield f"{100 * left_out:.2g} % of the rows have no number where depth or force stand"


def _doubts_of_phases(phases: Phases) -> list[str]:
    count = phases.loadings
    return [f"the record holds {count} loadings: the deepest is fitted"] * (count > 1)


def _check_loading(path: str, chosen: NDArray, count: int) -> None:
    if len(chosen) < FEWEST_SAMPLES:
        expected = f"expected {FEWEST_SAMPLES} samples or more of loading, in range and with weight"
        found = f"{len(chosen)} of {count} (are depth and force the right columns?)"
        raise ValueError(one_line(f"{path}: rows: {expected}, found {found}"))


def _check_samples(path: str, columns: list[NDArray], left_out: int) -> None:
    count = len(columns[0])
    if count < FEWEST_SAMPLES or left_out > MOST_LEFT_OUT * (count + left_out):
        found = f"{count} and {left_out} rows without"
        expected = f"expected at least {FEWEST_SAMPLES} rows with depth and force, and few without"
        raise ValueError(one_line(f"{path}: rows: {expected}, found {found}"))
    for name, values in zip(NAMES, columns, strict=False):
        if not np.ptp(values) > 0:
            expected = f"expected a column that changes (--{name}-column names another)"
            raise ValueError(
                one_line(f"{path}: {name}: {expected}, found {values[0]:g} throughout")
            )
        place = outlier(values)
        if place is not None:
            found = f"{values[place]:.6g} in row {place + 1} of the numbers (take it out)"
            expected = "expected no sample that leaves its neighbours by several times their range"
            raise ValueError(one_line(f"{path}: {name}: {expected}, found {found}"))
    for weights in columns[2:]:
        if not (weights.min() >= 0 and weights.max() > 0):
            found = f"{weights.min():g} to {weights.max():g}"
            line = f"{path}: weights: expected none below 0 and some above, found {found}"
            raise ValueError(one_line(line))


def _within(path: str, position: NDArray, range_m: tuple[float, float] | None) -> NDArray:
    """Which samples lie in a range."""
    if range_m is None:
        return np.ones(len(position), bool)
    used = (position >= min(range_m)) & (position <= max(range_m))
    if used.sum() < FEWEST_SAMPLES:
        ends = f"{1e3 * position.min():g} to {1e3 * position.max():g} mm"
        expected = f"expected a part of the depth's column, {ends}"
        found = f"{1e3 * range_m[0]:g} to {1e3 * range_m[1]:g}"
        raise ValueError(one_line(f"{path}: --range-mm: {expected}, found {found}"))
    return used


def _phases_told(phases: Phases, count: int) -> str:
    before = phases.loading.start
    loading, held, back = (
        part.stop - part.start for part in (phases.loading, phases.hold, phases.retract)
    )
    if loading == count:
        return f"{count} samples"
    parts = [f"{before} before"] if before else []
    parts += [f"{loading} of loading"]
    parts += [f"{held} of hold"] if held else []
    parts += [f"{back} of retract"] if back else []
    return f"{count} samples: {', '.join(parts)}; the loading is fitted"
