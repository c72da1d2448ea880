"""Corrupt the sample in many ways and compare how each ends with what was seen: ``make corpus``.

tests/corpus/expected.csv has each entry's outcome and line, as somebody read them. The exit status
is 1 where one ends otherwise; ``--update`` writes what was found.
"""

import argparse
import csv
import os
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

# Threads of this process would not be in those that it forks.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
os.environ |= dict.fromkeys(THREADS, "1")
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / part) for part in ("tests", "tests/workflow", "workflow/scripts")]

from corrupted import captures, doors, results, specifications, tables  # noqa: E402
from corrupted.places import make_places, place_of  # noqa: E402

EXPECTED = ROOT / "tests/corpus/expected.csv"
# In lines about results that are computed first, whose last digits differ between processors: where
# a file cut at half of its length ends, and a share found (not a limit) in whole percent.
BY_PROCESSOR = re.compile(r"\([^()]*\(char \d+\)\)|(?<=found )\d+%")
End = tuple[str, str]


def found(*, fast: bool, match: str = "") -> Iterator[tuple[str, str, str]]:
    """Entries with their outcomes and lines.

    ``fast`` leaves out the long look at the block's captures, and the workflow's jobs on them.
    """
    here = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="corpus-") as folder:
        work = Path(folder)
        make_places(work)
        doors.describe(work)
        try:
            for entry, *door in _entries(fast=fast):
                if re.search(match, entry):
                    end = doors.outcome(work, *door)
                    yield entry, *end
                    if end[0] in (doors.SAME, doors.CHANGED, doors.WARNED) and door[0] == "block":
                        if door[1] is doors.looked:
                            door[1] = doors.workflow
                            yield f"workflow of {entry}", *doors.outcome(work, *door)
        finally:
            os.chdir(here)


def _entries(*, fast: bool) -> Iterator[tuple]:
    for path, changes in (captures.ENTRIES | tables.ENTRIES | specifications.ENTRIES).items():
        place = place_of(path)
        door = doors.opened if fast and place == "block" else doors.looked
        door = {"curve.csv": doors.curve, "config.yaml": doors.opened}.get(path, door)
        for name, change in changes.items():
            yield f"{path}: {name}", place, door, path, change
    for key, changes in results.ENTRIES.items():
        path, script = key.split()
        for name, change in changes.items():
            yield f"{script} of {path}: {name}", "block", doors.script(script), path, change


def same(end: End, known: End | None) -> bool:
    """Whether an entry ends as it is known to; what passed a door may end at the next one."""
    if known is None:
        return False
    ends = [(outcome, BY_PROCESSOR.sub("", line)) for outcome, line in (end, known)]
    return ends[0] == ends[1] or (end == (doors.PASSED, "") and known[0] != doors.BY_FORM)


def expected() -> dict[str, End]:
    """Outcomes and lines as they were seen and read."""
    with EXPECTED.open(encoding="utf-8", newline="") as stream:
        return {row["entry"]: (row["outcome"], row["line"]) for row in csv.DictReader(stream)}


def write(ends: Mapping[str, End]) -> None:
    """Write the table of what is expected."""
    with EXPECTED.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["entry", "outcome", "line"])
        writer.writerows((entry, *ends[entry]) for entry in sorted(ends))


def main() -> int:
    """Run the entries, and compare or update."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--update", action="store_true", help="write what is found")
    parser.add_argument("--fast", action="store_true", help="what the tests run alone")
    parser.add_argument("--match", default="", help="entries that match this expression alone")
    options = parser.parse_args()
    known, ends = expected(), {}
    for entry, *end in found(fast=options.fast, match=options.match):
        if same(tuple(end), known.get(entry)):
            ends[entry] = known[entry]
        else:
            ends[entry] = tuple(end)
            print(f"{entry}\n  expected {known.get(entry)}\n  found    {ends[entry]}", flush=True)
    counts = ", ".join(f"{n} {end}" for end, n in Counter(e for e, _ in ends.values()).items())
    others = sum(ends[entry] != known.get(entry) for entry in ends)
    gone = set() if options.fast or options.match else known.keys() - ends.keys()
    for entry in sorted(gone):
        print(f"{entry}\n  expected {known[entry]}\n  found    no such entry")
    others += len(gone)
    print(f"{len(ends)} entries: {counts}; {others} otherwise than expected")
    if options.update:
        write(known | ends if options.fast or options.match else ends)
    return int(others > 0 and not options.update)


if __name__ == "__main__":
    sys.exit(main())
