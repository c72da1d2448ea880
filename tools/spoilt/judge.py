"""What the workflow makes of a mutation, in a process of its own."""

import contextlib
import io
import json
import os
import re
import resource
import select
import shutil
import signal
import time
import traceback
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from palpate.workflow.configuration import open_run
from palpate.workflow.run import Run
from thesis.options import Simulation
from virtual_lab.checks import lab_problems
from virtual_lab.specification import Lab

from spoilt.chain import Refused, run_chain
from spoilt.kept import reader_of
from spoilt.place import ROOT, Mutation, Place, linked_copy

# A busy machine gives a process little of its time: the processor's seconds are what counts.
LONGEST_CPU_S, LONGEST_S = 60, 400.0
MOST_BYTES = 4 << 30
LONGEST_LINE = 900
# Moduli within this of the unspoilt capture's are the right result.
SAME = 0.05
# What a line must say, and what none may hold.
CLEAR = re.compile(r"expected .*found |^error: .*expected .*found ", re.S)
NAMED = re.compile(r"^(error: )?[^:]+: ")
PASSED = "passes the check"
GOOD = (
    PASSED,
    "refused by the check",
    "refused by a job",
    "right result",
    "valid option",
    "cannot be known",
)


@dataclass(frozen=True)
class Verdict:
    """How a mutation ended."""

    mutation: str
    file: str
    outcome: str
    line: str
    seconds: float
    peak_mb: float

    @property
    def good(self) -> bool:
        """Whether nothing has to be mended."""
        return self.outcome in GOOD


def judge(
    mutation: Mutation,
    base: Path,
    work: Path,
    right: Mapping | None,
    *,
    check_only: bool = False,
) -> Verdict:
    """Run a mutation in a forked child with limits, and look at what it left.

    Parameters
    ----------
    mutation : Mutation
    base : path
        Whole place, of which the mutation gets a copy.
    work : path
        Where the copy and kept results go.
    right : mapping or None
        Moduli of the unspoilt capture [Pa]; None to take what comes out for right.
    check_only : bool, optional
        End with the check before the first job.
    """
    place = work / "place"
    shutil.rmtree(place, ignore_errors=True)
    around = set(os.listdir(work))
    begun = time.monotonic()
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        _in_child(mutation, base, place, work / "kept", right, writer, check_only)
    os.close(writer)
    answer, usage = _answer(child, reader)
    seconds = time.monotonic() - begun
    if set(os.listdir(work)) - around - {"place", "kept"}:
        answer = {"outcome": "WRITES OUTSIDE", "line": "beside the place"}
    peak = usage.ru_maxrss / 1024
    shutil.rmtree(place, ignore_errors=True)
    return Verdict(mutation.key, mutation.file, **answer, seconds=seconds, peak_mb=peak)


def _answer(child: int, reader: int) -> tuple[dict, resource.struct_rusage]:
    text, end = b"", time.monotonic() + LONGEST_S
    while True:
        ready, _, _ = select.select([reader], [], [], max(end - time.monotonic(), 0))
        if not ready:
            os.kill(child, signal.SIGKILL)
            break
        part = os.read(reader, 65536)
        if not part:
            break
        text += part
    os.close(reader)
    _, status, usage = os.wait4(child, 0)
    if text:
        return json.loads(text), usage
    late = os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGKILL, signal.SIGXCPU)
    outcome = "HANGS" if late else "DIES"
    return {"outcome": outcome, "line": f"status {status}"}, usage


def _in_child(
    mutation: Mutation,
    base: Path,
    place: Path,
    kept: Path,
    right: Mapping | None,
    writer: int,
    check_only: bool,
) -> None:
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MOST_BYTES,) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST_CPU_S, LONGEST_CPU_S + 5))
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            outcome, line = _ended(mutation, linked_copy(base, place), kept, right, check_only)
    except MemoryError:
        outcome, line = "MEMORY", "more than 4 GB"
    except BaseException as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        name = f"{Path(where.filename).name}:{where.lineno}"
        outcome, line = "TRACEBACK", f"{type(error).__name__}: {str(error)[:200]} ({name})"
    os.write(writer, json.dumps({"outcome": outcome, "line": line}).encode())
    os._exit(0)


def _ended(
    mutation: Mutation, place: Place, kept: Path, right: Mapping | None, check_only: bool
) -> tuple[str, str]:
    os.chdir(place.folder)
    if mutation.job:
        return _kept_result(mutation, place, kept)
    mutation.change(place)
    before = place.listing()
    try:
        # What people leave out has its default.
        place.config = opened(place.config).config
    except ValueError as error:
        lines = str(error).splitlines()
        return ("refused by the check", _shown(lines)) if _clear(lines) else ("UNCLEAR", lines[0])
    finally:
        _unchanged(before, place)
    if check_only:
        return PASSED, ""
    try:
        fit = run_chain(Place.relative(place), kept)
    except Refused as end:
        lines = str(end).splitlines()
        return ("refused by a job", _shown(lines)) if _clear(lines) else ("UNCLEAR", str(end))
    finally:
        _unchanged(before, place)
    return _compared(mutation, fit, right)


def _unchanged(before: Mapping, place: Place) -> None:
    changed = sorted(set(before.items()) ^ set(place.listing().items()))
    if changed:
        raise PermissionError(f"written outside results/: {changed[0][0]}")


def _kept_result(mutation: Mutation, place: Place, kept: Path) -> tuple[str, str]:
    """A result that was damaged after it was made: the one that reads it must say so."""
    relative = Place.relative(place)
    read = reader_of(mutation.job, relative, lambda: run_chain(relative, kept))
    mutation.change(relative)
    try:
        read()
    except (Refused, ValueError) as error:
        lines = str(error).splitlines()
        return ("refused by a job", _shown(lines)) if _clear(lines) else ("UNCLEAR", str(error))
    return ("right result" if mutation.option else "ACCEPTED"), ""


def _clear(lines: list[str]) -> bool:
    """Whether each line names a place, and says what was expected and found there."""
    return bool(lines) and all(
        CLEAR.search(line) and NAMED.search(line) and len(line) <= LONGEST_LINE
        and line.isprintable()
        for line in lines
    )  # fmt: skip


def opened(config: Mapping) -> Run:
    """A configuration as the workflow opens it."""
    return open_run(
        config,
        sources=["config/config.yaml"],
        project=ROOT,
        lab_kind=Lab,
        check_lab=lab_problems,
        blocks={"simulation": Simulation},
    )


def _shown(lines: list[str]) -> str:
    more = f" (and {len(lines) - 1} more lines)" if len(lines) > 1 else ""
    return lines[0] + more


def warm_up(base: Path) -> None:
    """Check an unspoilt place once, so that no child builds models of its own."""
    here = Path.cwd()
    os.chdir(base)
    try:
        opened(Place(base).config)
    finally:
        os.chdir(here)


def right_moduli(bases: Mapping[bool, Path], work: Path) -> dict[bool, dict[str, float]]:
    """Moduli of the unspoilt captures, with volts and with a wrench."""
    found = {}
    for volts, base in bases.items():
        whole = Mutation("none", "none", "none", lambda place: None, volts=volts)
        verdict = judge(whole, base, work, None)
        if verdict.outcome != "right result":
            raise ValueError(f"sample: expected a result, found {verdict.outcome}: {verdict.line}")
        found[volts] = json.loads(verdict.line)
    return found


def moduli(fit: Path) -> dict[str, float]:
    """Reduced moduli of a fit [Pa]: the recommended one and the study's."""
    content = json.loads(fit.read_text())
    return {name: content[name]["reduced_modulus_pa"] for name in ("recommended", "study")}


def _compared(mutation: Mutation, fit: Path, right: Mapping | None) -> tuple[str, str]:
    found = moduli(fit)["recommended"]
    if right is None:
        return "right result", json.dumps(moduli(fit))
    part = found / right["recommended"] - 1
    line = f"E* {found:.0f} Pa, {part:+.2%}"
    if abs(part) <= SAME:
        return "right result", line
    if mutation.told:
        return "cannot be known", f"{line}: {mutation.told}"
    return ("valid option" if mutation.option else "WRONG"), line


def row_of(verdict: Verdict) -> dict:
    """A row of the table, numbers rounded."""
    row = asdict(verdict)
    return row | {"seconds": f"{verdict.seconds:.2f}", "peak_mb": f"{verdict.peak_mb:.0f}"}
