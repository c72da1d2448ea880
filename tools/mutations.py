"""Spoil the sample in many ways and say how each ends: ``make mutations``.

Writes a table of every mutation and a summary; the exit status is 1 when one ends otherwise than
with a clear line or a right result.
"""

import argparse
import csv
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / part) for part in ("tests", "tests/workflow", "workflow/scripts")]

from spoilt.corpus import corpus, drawn  # noqa: E402
from spoilt.judge import Verdict, judge, right_moduli, row_of, warm_up  # noqa: E402
from spoilt.place import Mutation, make_bases  # noqa: E402


def main() -> int:
    """Judge the wanted mutations."""
    options = _parser().parse_args()
    chosen = [one for one in corpus() if re.search(options.match, one.key)]
    if options.check:
        chosen = [one for one in chosen if not one.job]
    if options.count:
        chosen = drawn(chosen, min(options.count, len(chosen)), seed=options.seed)
    part, parts = map(int, options.part.split("/"))
    chosen = chosen[part - 1 :: parts]
    options.table.parent.mkdir(parents=True, exist_ok=True)
    verdicts = []
    with options.table.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, Verdict.__dataclass_fields__, lineterminator="\n")
        writer.writeheader()
        for verdict in judged(chosen, check_only=options.check):
            verdicts.append(verdict)
            writer.writerow(row_of(verdict))
            stream.flush()
    return _told(verdicts)


def judged(chosen: Sequence[Mutation], *, check_only: bool = False) -> Iterator[Verdict]:
    """Verdicts on mutations, one after the other; the bad ones are shown at once."""
    with tempfile.TemporaryDirectory(prefix="mutations-") as folder:
        work = Path(folder)
        bases = make_bases(work)
        warm_up(bases[True])
        deep = set() if check_only else {one.volts for one in chosen if not one.job}
        right = right_moduli({volts: bases[volts] for volts in sorted(deep)}, work)
        for one in chosen:
            verdict = judge(
                one, bases[one.volts], work, right.get(one.volts), check_only=check_only
            )
            if not verdict.good:
                sys.stderr.write(f"{verdict.outcome}: {verdict.mutation}: {verdict.line}\n")
            yield verdict


def _told(verdicts: list[Verdict]) -> int:
    sys.stdout.write(f"{len(verdicts)} mutations\n")
    for outcome, count in sorted(Counter(one.outcome for one in verdicts).items()):
        sys.stdout.write(f"  {count:4d} {outcome}\n")
    slowest = max(verdicts, key=lambda one: one.seconds)
    largest = max(verdicts, key=lambda one: one.peak_mb)
    sys.stdout.write(f"slowest {slowest.seconds:.1f} s ({slowest.mutation})\n")
    sys.stdout.write(f"largest {largest.peak_mb:.0f} MB ({largest.mutation})\n")
    return 0 if all(one.good for one in verdicts) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path, help="where the table goes, results/mutations.csv")
    parser.add_argument("--check", action="store_true", help="just the check before the first job")
    parser.add_argument("--match", default="", help="just those whose names match this expression")
    parser.add_argument("--count", type=int, help="just so many, drawn")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--part", default="1/1", metavar="K/N", help="of what is left, the K-th of N"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
