"""One curve of force against depth, of a file as an instrument wrote it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.capture.curves.columns import DEPTH, FORCE, Column, column_of, is_tips, numbers_of
from palpate.capture.curves.export import fault, read_export
from palpate.capture.curves.phases import Phases, free_from, outlier, phases_of, signs_of
from palpate.yaml_files import mismatch

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
        force [N], growing with it; in the order of the record.
    chosen : (k,) int array
        Samples of approach and loading that are in range.
    phases : Phases
    depth_sign : int
        Of ``depth_m`` against the file's column.
    read : str
        How the file was read, in words.
    warnings : tuple of str
        What of that may be otherwise, a line each.
    """

    path: str
    depth_m: NDArray
    force_n: NDArray
    chosen: NDArray
    phases: Phases
    depth_sign: int
    read: str
    warnings: tuple[str, ...]

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
    range_m: tuple[float, float] | None = None,
    stiffness_n_m: float | None = None,
    radius_m: float | None = None,
) -> Curve:
    """Read a curve.

    Parameters
    ----------
    path : path
        Text table with columns of depth and force; ``-`` is standard input.
    depth_column, force_column : str, optional
        Name or number (from 1), where the header does not state it.
    depth_unit, force_unit : str, optional
        Like mm, mN; the header's by default.
    range_m : (float, float), optional
        Least and greatest value of the depth's column that are used [m], as the file counts.
    stiffness_n_m : float, optional
        Of what is compliant between drive and tip, such as a cantilever [N/m]: its deflection
        is taken off a depth whose column is not named as the tip's.
    radius_m : float, optional
        Of the indenter: a warning says where the file states another, as with the stiffness.

    Raises
    ------
    ValueError
        Naming file, column and remedy, if it is no curve.

    Examples
    --------
    >>> curve = read_curve("tests/real/curves/fmt-jpk-fd_spot3-0192_0.csv")
    >>> print(curve.read)
    depth in m (tip_position), force in N, depth sign turned, 2000 samples
    >>> depth_m, force_n = curve.loading()
    >>> depth_m.shape
    (2000,)
    """
    given = {"radius_m": radius_m, "stiffness_n_m": stiffness_n_m}
    for name, value in given.items():
        if value is not None and not 0 < value < np.inf:
            raise mismatch(name, "above 0", value)
    export = read_export(path)
    depth = column_of(export, DEPTH, depth_column, depth_unit)
    force = column_of(export, FORCE, force_column, force_unit)
    columns, left_out = numbers_of([depth.values, force.values])
    _check_samples(export.path, columns, left_out)
    signs, plain = signs_of(*columns)
    of_tip = depth.of_tip
    if stiffness_n_m and not of_tip:
        of_tip = is_tips(export, signs[0] * depth.values, signs[1] * force.values, stiffness_n_m)
    used = _within(export.path, columns[0], range_m)
    read = [*export.read, depth.text, force.text]
    read += [f"{name} sign turned" for name, sign in zip(NAMES, signs, strict=True) if sign < 0]
    read += [f"{left_out} rows without a number left out"] if left_out else []
    read += [] if used.all() else [f"{used.sum()} of {len(used)} samples in range"]
    depth_m, force_n = (sign * values for sign, values in zip(signs, columns, strict=True))
    free, first = free_from(depth_m), np.argmax(depth_m) < BEGINS * len(depth_m)
    if backwards := not free and bool(first and depth_m[0] > depth_m[-1]):
        depth_m, force_n, used = (one[::-1] for one in (depth_m, force_n, used))
    phases = phases_of(depth_m, force_n)
    if stiffness_n_m is not None and not of_tip:
        _check_spring(depth.name, float(np.ptp(force_n)) / stiffness_n_m, float(np.ptp(depth_m)))
        depth_m = depth_m - force_n / stiffness_n_m
        read += [f"force over {stiffness_n_m:g} N/m taken off the depth"]
    chosen = _chosen(export.path, used, phases)
    warnings = [*export.warnings, *depth.warnings, *force.warnings]
    warnings += _warnings(plain, backwards, free, left_out / (left_out + len(used)))
    warnings += _warnings_of_spring(depth, of_tip, given, export.stated)
    if phases.loadings > 1:
        warnings += [f"the record holds {phases.loadings} loadings: the deepest is fitted"]
    return Curve(
        path=export.path,
        depth_m=depth_m,
        force_n=force_n,
        chosen=chosen,
        phases=phases,
        depth_sign=signs[0],
        read=", ".join([*read, phases.summary(len(used))]),
        warnings=tuple(warnings),
    )


def _chosen(path: str, used: NDArray, phases: Phases) -> NDArray:
    """Places of the used samples of the loading."""
    chosen = phases.loading.start + np.flatnonzero(used[phases.loading])
    if len(chosen) < FEWEST_SAMPLES:
        expected = f"{FEWEST_SAMPLES} samples or more of loading, in range"
        found = f"{len(chosen)} of {len(used)} (are depth and force the right columns?)"
        raise fault(path, "rows", expected, found)
    return chosen


def _warnings(plain: bool, backwards: bool, free: int, left_out: float) -> Iterator[str]:
    """What of the columns may be otherwise, a line each."""
    if free:
        yield (
            f"the record begins pressed: its first {free} samples, up to the least depth, count"
            " for nothing (export one cycle alone to have another)"
        )
    elif backwards:
        yield "the record begins at its deepest, as a retract does: its rows were turned"
    if not plain:
        begins = "pressed" if free or backwards else "free"
        yield (
            "which end of the record is free is not plain (a force that softens?): it is taken to"
            f" begin {begins}"
        )
    if left_out > FEW_LEFT_OUT:
        yield f"{100 * left_out:.2g} % of the rows have no number where depth or force stand"


def _warnings_of_spring(
    depth: Column, of_tip: bool, given: Mapping[str, float | None], stated: Mapping[str, float]
) -> Iterator[str]:
    """What of the way between drive and tip, and of what the file states, may be otherwise."""
    asked = given["stiffness_n_m"] is not None
    if depth.of_drive and not asked:
        yield (
            f"{depth.name} is the way of the drive, not of the tip: what gives way between them"
            " counts as the object (--stiffness-n-m takes it off)"
        )
    if of_tip and asked:
        yield (
            f"{depth.name} is the tip's own depth: --stiffness-n-m takes nothing off it (if it is"
            " the drive's, rename the column)"
        )
    for name, value in given.items():
        there = stated.get(name, value)
        if value is not None and abs(there / value - 1) > SAME:
            yield f"the file states {name} {there:.4g}, where {value:.4g} was given"
    if "stiffness_n_m" in stated and not (asked or of_tip):
        line = f"the file states a spring of {stated['stiffness_n_m']:g} N/m"
        yield f"{line}: --stiffness-n-m takes it off, if {depth.name} is the drive's way"


def _check_spring(name: str, bent_m: float, way_m: float) -> None:
    if bent_m > way_m:
        found = f"one that gives way by {bent_m:.3g} m (is {name} the tip's own, or it another?)"
        expected = f"a spring that gives way by less than the depth's {way_m:.3g} m"
        raise mismatch("--stiffness-n-m", expected, found)


def _check_samples(path: str, columns: Sequence[NDArray], left_out: int) -> None:
    count = len(columns[0])
    if count < FEWEST_SAMPLES or left_out > MOST_LEFT_OUT * (count + left_out):
        expected = f"at least {FEWEST_SAMPLES} rows with depth and force, and few without"
        raise fault(path, "rows", expected, f"{count} and {left_out} rows without")
    for name, values in zip(NAMES, columns, strict=True):
        if not np.ptp(values) > 0:
            expected = f"a column that changes (--{name}-column names another)"
            raise fault(path, name, expected, f"{values[0]:g} throughout")
        if (place := outlier(values)) is not None:
            found = f"{values[place]:.6g} in row {place + 1} of the numbers (take it out)"
            expected = "no sample that leaves its neighbours by several times their range"
            raise fault(path, name, expected, found)


def _within(path: str, position: NDArray, range_m: tuple[float, float] | None) -> NDArray:
    """Which samples lie in a range."""
    if range_m is None:
        return np.ones(len(position), bool)
    used = (position >= min(range_m)) & (position <= max(range_m))
    if used.sum() < FEWEST_SAMPLES:
        ends = f"{1e3 * position.min():g} to {1e3 * position.max():g} mm"
        found = f"{1e3 * range_m[0]:g} to {1e3 * range_m[1]:g}"
        raise fault(path, "--range-mm", f"a part of the depth's column, {ends}", found)
    return used
