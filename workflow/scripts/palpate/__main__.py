"""The command ``palpate``: what the workflow does, for single captures and curves."""

import argparse
import os
import signal
import sys
from contextlib import redirect_stderr
from importlib import import_module
from types import SimpleNamespace

from palpate import __version__
from palpate.commands.help import Parser

# In the order in which a person meets them; only the one that is asked for is loaded.
VERBS = "hertz new board calibrate noise plan import check direct export".split()
# A keyword is no module's name.
MODULES = {"import": "recording"}


def main(arguments: list[str] | None = None) -> int:
    """Run a command; the exit status is 1 where it fails, with one line on what is wrong."""
    arguments = sys.argv[1:] if arguments is None else arguments
    options = _parser(arguments[:1]).parse_args(arguments)
    stream = sys.stderr
    if "quiet" in options:  # no terminal, so that nobody draws a bar
        stream = SimpleNamespace(write=stream.write, flush=stream.flush, isatty=lambda: False)
        stream.quiet = True
    try:
        with redirect_stderr(stream):
            status = options.work(options) or 0
    except BrokenPipeError:
        status = 128 + signal.SIGPIPE
    except (ValueError, OSError) as error:
        for line in _told(error).splitlines():
            print(f"error: {line}", file=sys.stderr)
        status = 1
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        # Nobody reads on, like head; the interpreter flushes once more as it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return status


def _told(error: ValueError | OSError) -> str:
    """What is wrong: of a file that can't be read or written first its name."""
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)


def _parser(first: list[str]) -> argparse.ArgumentParser:
    parser = Parser(
        prog="palpate",
        description="How stiff soft things are: curves, recordings, captures, estimates.",
        epilog="palpate <command> --help ends with an example of it.",
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="command", title="commands")
    wanted = [name for name in VERBS if name in first]
    for name in wanted or (VERBS if first != ["--version"] else ()):
        import_module(f"palpate.commands.{MODULES.get(name, name)}").add(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
