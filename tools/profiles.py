"""Where each rule's time goes: the functions that most of it was spent in.

``PALPATE_PROFILES=$PWD/results/profiles make cut`` writes a profile of each job of the cut;
``python tools/profiles.py results/profiles`` makes a table of them.
"""

import pstats
import re
import sys
from collections import defaultdict
from pathlib import Path

# Rules with less than this are left out [s], and how many functions are named.
LEAST_S, NAMED = 1.0, 4
METHOD = re.compile(r"<(?:built-in )?method (?:builtins\.)?'?(?P<name>[\w.]+)'?.*>")


def table_of(folder: Path) -> str:
    """Markdown table: rule, jobs, seconds, and shares of the functions with most of their own."""
    files = defaultdict(list)
    for path in sorted(folder.glob("*.prof")):
        files[path.name.split("-")[0].removesuffix(".prof")].append(str(path))
    rows = []
    for rule, paths in files.items():
        stats = pstats.Stats(*paths)
        if stats.total_tt >= LEAST_S:
            rows.append((stats.total_tt, rule, len(paths), _named(stats)))
    lines = ["| rule | jobs | s | most of it in |", "|---|---|---|---|"]
    for seconds, rule, count, named in sorted(rows, reverse=True):
        lines.append(f"| {rule} | {count} | {seconds:.0f} | {named} |")
    return "\n".join(lines)


def _named(stats: pstats.Stats) -> str:
    own = defaultdict(float)
    for (file, _, function), (_, _, seconds, _, _) in stats.stats.items():
        found = METHOD.fullmatch(function)
        name = found["name"].split(".")[-1] if found else function
        place = f"{Path(file).stem}." if file != "~" else ""
        own[f"`{place}{name}`"] += seconds
    first = sorted(own.items(), key=lambda item: -item[1])[:NAMED]
    return ", ".join(f"{name} {seconds / stats.total_tt:.0%}" for name, seconds in first)


if __name__ == "__main__":
    sys.stdout.write(f"{table_of(Path(sys.argv[1]))}\n")
