"""The doors through which files come in, and how each ends with a corrupted one.

Each gives an outcome and a line: of what is wrong, or of what is found in place of the right.
"""

import contextlib
import io
import json
import os
import re
import resource
import signal
import traceback
from collections.abc import Callable
from pathlib import Path

import yaml
from palpate.__main__ import main
from palpate.workflow.configuration import open_run
from thesis.options import StudyConfig

from corrupted.chain import jobs, run_chain, run_script
from corrupted.places import ROOT, configuration, enter_copy, listing, place_of

# A busy machine gives a process little of its time: the processor's seconds are what counts.
LONGEST_CPU_S, LONGEST_S = 60, 300
MOST_BYTES = 4 << 30
LONGEST_LINE = 900
BY_FORM, BY_CONTENT, PASSED = "rejected", "rejected by its content", "accepted"
SAME, CHANGED, WARNED = "same numbers", "changed numbers", "warning"
ENDS = {BY_FORM, BY_CONTENT, PASSED, SAME, CHANGED, WARNED}


def opened(path: str) -> tuple[str, str]:
    """What a run looks at before its first job."""
    config = yaml.safe_load(Path("config.yaml").read_text())
    images = path != "config.yaml"
    try:
        open_run(config, sources=["config.yaml"], project=ROOT, files=images, kind=StudyConfig)
    except ValueError as error:
        return BY_FORM, _joined(str(error).splitlines())
    return PASSED, ""


def looked(path: str) -> tuple[str, str]:
    """`palpate check`: what is wrong, else what it says otherwise than of the right file."""
    form = opened(path)
    status, lines = _checked()
    if form[0] == BY_FORM:
        return form if status else ("ACCEPTED by palpate check", form[1])
    about = [line for line in lines if not line.startswith("  ")]
    if status:
        return BY_CONTENT, _joined([line for line in about if not line.endswith("nothing wrong")])
    warnings = [line for line in about if line.startswith("worth a look")]
    known = _parts(Path(f"../{place_of(path)}.txt").read_text().splitlines())
    changed = [part for part in _parts(lines) if part not in known]
    if warnings:
        return WARNED, _joined(warnings)
    return (CHANGED, "; ".join(changed)) if changed else (SAME, "")


def _checked() -> tuple[int, list[str]]:
    with contextlib.redirect_stdout(io.StringIO()) as told:
        with contextlib.redirect_stderr(io.StringIO()) as errors:
            status = main(["check"])
    return status, (told.getvalue() or errors.getvalue()).splitlines()


def _parts(lines: list[str]) -> list[str]:
    return [part for line in lines for part in line.strip().split(", ")]


def curve(path: str) -> tuple[str, str]:
    """`palpate hertz`: E* of a curve."""
    with contextlib.redirect_stdout(io.StringIO()) as told:
        with contextlib.redirect_stderr(io.StringIO()) as errors:
            status = main(["hertz", path, "--radius-mm", "0.01", "--json"])
    if status:
        return BY_FORM, _joined(errors.getvalue().splitlines())
    found = json.loads(told.getvalue())
    end, line = _number(found["reduced_modulus_pa"], "../curve.txt")
    return (WARNED, f"{line}: {_joined(found['warnings'])}") if found["warnings"] else (end, line)


def script(name: str) -> Callable[[str], tuple[str, str]]:
    """A stage that reads a result damaged after it was made."""

    def door(path: str) -> tuple[str, str]:
        try:
            run_script(name, *jobs(configuration())[name])
        except ValueError as error:
            return BY_FORM, _joined(str(error).splitlines())
        return PASSED, ""

    return door


def workflow(path: str) -> tuple[str, str]:
    """The stages up to E* of the Hertz fit, from the first cloud."""
    try:
        return _number(run_chain(configuration()), "../workflow.txt")
    except ValueError as error:
        return BY_CONTENT, _joined(str(error).splitlines())


def _number(found: float, known: str) -> tuple[str, str]:
    right = float(Path(known).read_text()) if Path(known).exists() else found
    change = round(100 * (found / right - 1), 1) + 0.0
    line = f"E* {found:.3g} Pa, {change:+.1f} %"
    return CHANGED if change else SAME, line


def _joined(lines: list[str]) -> str:
    more = f" (and {len(lines) - 1} more lines)" if len(lines) > 1 else ""
    return (lines[0] if lines else "") + more


def describe(work: Path) -> None:
    """Note what is said of the uncorrupted files; imports are made once for all."""
    for place in ("cow", "block"):
        os.chdir(work / place)
        status, lines = _checked()
        if status or opened("")[0] != PASSED:
            raise ValueError(f"{place}: expected the sample to be right, found {lines}")
        (work / f"{place}.txt").write_text("\n".join(lines))
    with contextlib.redirect_stdout(io.StringIO()) as told:
        main(["hertz", "curve.csv", "--radius-mm", "0.01", "--json"])
    found = json.loads(told.getvalue())["reduced_modulus_pa"]
    (work / "curve.txt").write_text(repr(found))
    right = _forked(lambda: repr(run_chain(configuration())))
    if right is None:
        raise ValueError("block: expected the sample's E* from its jobs, found none")
    (work / "workflow.txt").write_text(right)
    (work / "block/results/log.txt").unlink()


def outcome(work: Path, place: str, door: Callable, path: str, change: Callable) -> tuple[str, str]:
    """How an entry ends, in a process of its own with limits of memory and time."""
    return tuple(_forked(lambda: _in_child(work, place, door, path, change)) or ("DEAD", ""))


def _forked(call: Callable) -> object:
    """What a call gives in a process of its own; None where that dies."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        # Nothing of the parent's runs in the child, whatever the call raises.
        try:
            os.close(reader)
            os.write(writer, json.dumps(call()).encode())
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as stream:
        text = stream.read()
    os.waitpid(child, 0)
    return json.loads(text) if text else None


def _in_child(work: Path, place: str, door: Callable, path: str, change: Callable) -> tuple:
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MOST_BYTES,) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST_CPU_S, LONGEST_CPU_S + 5))
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(LONGEST_S)
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    try:
        enter_copy(work, place)
        change(Path(path))
        before = listing()
        end, line = door(path)
        written = sorted(set(before.items()) ^ set(listing().items()))
    except BaseException as error:
        file = Path(traceback.extract_tb(error.__traceback__)[-1].filename).name
        return "TRACEBACK", f"{type(error).__name__}: {str(error)[:200]} ({file})"
    if written:
        return "WRITES beside results/", written[0][0]
    line = re.sub(r" at 0x[0-9a-f]+", "", line)
    return ("UNCLEAR" if end in (BY_FORM, BY_CONTENT) and not clear(line) else end), line


def clear(line: str) -> bool:
    """Whether a line names a place, and says what was expected and found there."""
    named = re.search(r"^(error: )?[^:]+: .*expected .*found ", line)
    return bool(named) and line.isprintable() and len(line) <= LONGEST_LINE and "defect" not in line
