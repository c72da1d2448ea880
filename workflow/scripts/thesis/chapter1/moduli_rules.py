"""The path from a capture to its moduli, found by asking the workflow's rules."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from snakemake.io import strip_wildcard_constraints

from thesis.run import StudyRun

# Stages that share a file of rules with others.
STAGES = {"hertz": "hertz", "minimise": "elasticity"}


def path_to_moduli(run: StudyRun, rules: Iterable[Any]) -> list[dict]:
    """Rules from the recordings to (E, nu), each with what it reads of which other.

    The path is walked back from the results of the first minimised capture of each object by each
    sensor: a new rule on it comes by itself.

    Parameters
    ----------
    run : StudyRun
    rules : iterable
        Snakemake's rules.
    """
    firsts = {(c.object, c.sensor): c for c in reversed(run.minimised)}
    wanted = {
        run.of_capture(name).format(**vars(capture))
        for capture in firsts.values()
        for name in run.minima
    }
    found: dict[str, dict] = {}
    waiting, seen = sorted(wanted), set(wanted)
    while waiting:
        path = waiting.pop()
        writer = _writer_of(path, rules)
        entry = found.setdefault(writer.name, {"recorded": set(), "reads": {}, "wanted": set()})
        entry["stage"] = STAGES.get(writer.name, Path(writer.snakefile).stem)
        if path in wanted:
            entry["wanted"].add(_pattern_of(writer, path))
        for needed in map(str, writer.expand_input(writer.get_wildcards(path))[0]):
            if needed.startswith(run.raw("")):
                entry["recorded"].add(_recording_name(run, needed))
            elif other := _writer_of(needed, rules):
                files = entry["reads"].setdefault(other.name, set())
                files.add(_pattern_of(other, needed))
                if needed not in seen:
                    seen.add(needed)
                    waiting.append(needed)
    return [
        {
            "rule": name,
            "stage": entry["stage"],
            "recorded": sorted(entry["recorded"]),
            "reads": {other: sorted(files) for other, files in sorted(entry["reads"].items())},
            "wanted": sorted(entry["wanted"]),
        }
        for name, entry in sorted(found.items())
    ]


def _writer_of(path: str, rules: Iterable[Any]) -> Any:
    """Rule that writes a result."""
    return next((step for step in rules if step.is_producer(path)), None)


def _pattern_of(writer: Any, path: str) -> str:
    """Name of a file as the rule that writes it has it, with its wildcards."""
    names = writer.get_wildcards(path)
    for pattern in map(strip_wildcard_constraints, writer.output):
        if pattern.format(**names) == path:
            return Path(pattern).name
    return Path(path).name


def _recording_name(run: StudyRun, path: str) -> str:
    """What a recording is, without whose it is."""
    captures = {run.raw(f"{c.object}/{c.sensor}/{c.capture}") for c in run.minimised}
    return "capture" if path in captures else Path(path).name
