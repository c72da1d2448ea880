"""The page of all options, docs/options.md: ``python -m palpate.run.options_page PAGE``."""

import inspect
import sys
from dataclasses import fields
from pathlib import Path
from typing import get_type_hints

from palpate.capture.files import whole_file
from palpate.markdown import rows_of
from palpate.options import Options, rows
from palpate.run.options import Config
from palpate.surface.options import TRACKERS

HEAD = """# Options

What `config/config.yaml`, `config/thesis.yaml`, or a file given with `--configfile` may say. What
is left out has its default. Units are in the names. This page is written by `make docs`.
"""


def options_page() -> str:
    """All options as Markdown: a table for each block, and for each kind of tracker."""
    kinds = get_type_hints(Config)
    blocks = {f.name: kinds[f.name] for f in fields(Config) if isinstance(kinds[f.name], type)}
    blocks = {name: kind for name, kind in blocks.items() if issubclass(kind, Options)}
    plain = [row for row in rows(Config) if row[0].partition(".")[0] not in blocks]
    parts = [HEAD, "## The run", _table(plain)]
    for name, kind in blocks.items():
        parts += [f"## {name}", "", _words(kind), _table(rows(kind, f"{name}."))]
    for name, kind in TRACKERS.items():
        parts += [f"## Trackers of kind {name}", "", _words(kind), _table(rows(kind))]
    return "\n".join(parts)


def _words(kind: type[Options]) -> str:
    """What a block is, without its example."""
    return inspect.getdoc(kind).partition("\n\nExamples")[0]


def _table(found) -> str:
    cells = ((f"`{place}`", *words) for place, *words in found)
    lines = rows_of(("option", "default", "allowed", "meaning"), cells)
    return "\n" + "\n".join(lines) + "\n"


if __name__ == "__main__":
    with whole_file(Path(sys.argv[1])) as part:
        part.write_text(options_page(), encoding="utf-8")
