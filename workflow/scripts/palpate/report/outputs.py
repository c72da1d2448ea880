"""How what a function makes becomes files: figures, tables, JSON, or what writes itself."""

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from palpate.capture.files import whole_file
from palpate.capture.tables import write_table
from palpate.report import pages, style, tables

Made = pd.DataFrame | str | Mapping | Sequence | Callable[[Path], None]


def table(frame: pd.DataFrame, *, title: str, **notes: Sequence[str]) -> dict[str, Made]:
    """A table with a column ``provenance`` as it goes to CSV and to Markdown.

    Notes are ``more_notes`` and ``last_notes``, before and after what its rows call for.
    """
    return {"csv": frame, "md": tables.markdown(frame, title=title, **notes)}


def exact(frame: pd.DataFrame) -> Callable[[Path], None]:
    """A table that other stages read, its numbers to nine digits."""
    return lambda path: write_table(path, frame)


def write(made: Figure | Mapping[str, Made], output: object) -> None:
    """Write what a function made: all files, or none. A page is made of the Markdown.

    What was made is by the name of the rule's output; ``figure``, or a figure alone, goes to
    ``png`` and ``svg``. Outputs are paths by name, as a rule has them.

    Raises
    ------
    ValueError
        If what was made has other names than the outputs.
    """
    things = {"figure": made} if isinstance(made, Figure) else dict(made)
    figure = things.pop("figure", None)
    names = {*things, *(("png", "svg") if figure else ())}
    for name in output.keys():
        if name.endswith("page") and name not in things:
            text = things[name.removesuffix("page") + "md"]
            things[name] = pages.page(text, title=Path(output[name]).stem)
            names.add(name)
    if names != set(output.keys()):
        found = ", ".join(sorted(names))
        raise ValueError(f"made: expected {', '.join(sorted(output.keys()))}, found {found}")
    with ExitStack() as files:
        parts = {name: files.enter_context(whole_file(output[name])) for name in sorted(names)}
        if figure:
            style.save(figure, parts["png"], parts["svg"])
        for name, thing in things.items():
            _write(thing, parts[name])


def _write(thing: Made, path: Path) -> None:
    if isinstance(thing, pd.DataFrame):
        thing.to_csv(path, index=False, lineterminator="\n")
    elif isinstance(thing, str):
        path.write_text(thing, encoding="utf-8")
    elif callable(thing):
        thing(path)
    else:
        path.write_text(json.dumps(thing, indent=2) + "\n", encoding="utf-8")
