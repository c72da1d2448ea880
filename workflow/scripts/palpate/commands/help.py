"""What verbs of the command share: help, progress, columns of curves, where figures may go."""

import argparse
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import floor, inf, log10
from pathlib import Path
from threading import Event, Thread
from typing import Any, NoReturn

FIGURES = (".png", ".svg", ".pdf")
# What argparse says of a value, and what a person reads.
WORDS = {
    r"^argument ": "",
    r"invalid float value: '(.*)'": r"expected a number, found \1",
    r"invalid int value: '(.*)'": r"expected a whole number, found \1",
    r"invalid choice: '(.*)' \(choose from (.*)\)": r"expected one of \2, found \1",
}


class Parser(argparse.ArgumentParser):
    """Parser of the command, of a verb or of a part: options by their whole names, --quiet."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**{"allow_abbrev": False} | given)
        text = "no progress, only results, warnings and errors"
        self.add_argument("--quiet", action="store_true", default=argparse.SUPPRESS, help=text)

    def error(self, message: str) -> NoReturn:
        """End with one line on what is wrong in place of the usage."""
        for said, read in WORDS.items():
            message = re.sub(said, read, message)
        self.exit(2, f"error: {message} (see {self.prog} --help)\n")


@contextmanager
def stage(text: str, *, lasting: bool = False) -> Iterator[None]:
    """Say what goes on: on a terminal with the time that it takes; ``lasting`` in a log too."""
    if not sys.stderr.isatty():
        if lasting and not hasattr(sys.stderr, "quiet"):
            print(text, file=sys.stderr, flush=True)
        yield
        return
    from tqdm import tqdm

    over, form = Event(), "{desc} ({elapsed})"
    with tqdm(desc=text, bar_format=form, leave=lasting, dynamic_ncols=True) as bar:
        clock = Thread(target=lambda: [bar.refresh() for _ in iter(lambda: over.wait(1), True)])
        clock.start()
        try:
            yield
        finally:
            over.set()
            clock.join()


def add_verb(
    commands: Any, name: str, short: str, work: Any, *, about: str, example: str, **given: Any
) -> argparse.ArgumentParser:
    """Add a verb to the commands of `argparse`'s ``add_subparsers``.

    ``short`` is its line in the table of contents; ``work`` takes the options and gives the exit
    status or None; ``about`` and ``example`` begin and end its help; ``given`` are further
    arguments of its parser, like ``parents``.
    """
    texts = {"help": short, "description": about, "epilog": f"example:\n  {example}"}
    form = argparse.RawDescriptionHelpFormatter
    verb = commands.add_parser(name, formatter_class=form, **texts, **given)
    verb.set_defaults(work=work)
    return verb


def add_columns(verb: argparse.ArgumentParser) -> None:
    """Add what a curve's header may leave open: which columns are depth and force, and units."""
    for name, unit in (("depth", "m, mm, um, nm ..."), ("force", "N, mN, uN, nN, gf ...")):
        verb.add_argument(f"--{name}-column", metavar="NAME", help="or its number, from 1")
        verb.add_argument(f"--{name}-unit", metavar="UNIT", help=unit)


def check_figure(path: Path | None) -> None:
    """Raise ValueError for a figure of another kind than is drawn, before the work begins."""
    if path is not None and path.suffix.lower() not in FIGURES:
        kinds = ", ".join(FIGURES)
        raise ValueError(f"--figure: expected a file that ends with one of {kinds}, found {path}")


def counts(text: str) -> tuple[int, int]:
    """Two numbers like 7x5, as the type of an option."""
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.strip().isdigit() for part in parts):
        raise argparse.ArgumentTypeError(f"expected two counts like 7x5, found {text}")
    return int(parts[0]), int(parts[1])


def check_outputs(outputs: Mapping[str, Path | None], read: Sequence[Path]) -> None:
    """Raise ValueError where an option writes over what is read, over a folder or another's file.

    ``outputs`` has paths by the names of options.
    """
    places = {path.resolve() for path in read}
    for name, path in outputs.items():
        if path is None:
            continue
        if path.is_dir() or not path.parent.is_dir():
            found = "a folder" if path.is_dir() else "a folder that is not there"
            raise ValueError(f"--{name}: expected a file, found {found}: {path}")
        if path.resolve() in places:
            raise ValueError(f"--{name}: expected a file of its own, found {path} in use already")
        places.add(path.resolve())


def sure(value: float, error: float) -> str:
    """A value to the second digit of its standard error."""
    digits = max(0, 1 - floor(log10(error))) if 0 < error < inf else 6
    return f"{value:.{digits}f} +- {error:.{digits}f}"


def all_sure(values: Sequence[float], errors: Sequence[float], scale: float) -> str:
    """Values in another unit, each to the second digit of its standard error."""
    pairs = zip(values, errors, strict=True)
    return ", ".join(sure(value * scale, error * scale) for value, error in pairs)
