"""How a run ends that can't begin: one line for each thing that is wrong, and nothing else."""

import sys
from collections.abc import Callable, Mapping
from typing import NoReturn

from palpate.run.objects import too_many


def refuse(error: ValueError) -> NoReturn:
    """End Snakemake with an error's lines, as jobs end with theirs, and the exit status 1.

    An exception would be shown with its name and with lines of the workflow's code, and with
    ``--quiet all`` not at all.

    Parameters
    ----------
    error : ValueError
        Its text has one line for each thing that is wrong.

    Raises
    ------
    SystemExit
        Always.
    """
    sys.stderr.write("".join(f"error: {line}\n" for line in str(error).splitlines()))
    raise SystemExit(1) from None


def require_values(given: Mapping) -> None:
    """Hold what stands after ``--config`` to having values: an empty one would mean none is wanted.

    Parameters
    ----------
    given : mapping
        The command line's entries alone.

    Raises
    ------
    ValueError
        With one line for each entry that is empty.
    """
    empty = [name for name, value in given.items() if value is None]
    if empty:
        hint = "leave it out for what the configuration says"
        lines = [f"--config {name}=: expected a value, found nothing ({hint})" for name in empty]
        raise ValueError("\n".join(lines))


def look_first(config: Mapping, given: Mapping, *, warn: Callable[[str], None]) -> None:
    """Refuse options without a value, and warn of more captures than a run is for.

    Parameters
    ----------
    config : mapping
        As merged, not yet checked.
    given : mapping
        What the command line says of it.
    warn : callable
        Takes a line.

    Raises
    ------
    ValueError
        As `require_values` does.
    """
    if words := too_many(config):
        warn(words)
    require_values(given)
