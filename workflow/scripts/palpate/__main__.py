"""The command ``palpate``: what the workflow does, for single captures and curves."""

import argparse
import os
import signal
import sys
from contextlib import redirect_stderr
from importlib import import_module
from importlib.util import find_spec
from types import SimpleNamespace

from palpate import __version__
from palpate.commands.help import Parser

# In the order in which a person meets them, each with the extra of pyproject.toml that it needs;
# only the one that is asked for is loaded.
VERBS = {"hertz": "", "new": "vision", "board": "vision", "calibrate": "vision", "noise": "mesh"}
VERBS |= {"plan": "mesh", "import": "vision", "check": "mesh", "direct": "mesh", "export": "vision"}
# Packages that are there only with an extra: what a verb needs is said before its work begins.
SIGNS = {"": (), "vision": ("cv2",), "mesh": ("cv2", "open3d")}
# A keyword is no module's name.
MODULES = {"import": "recording"}


def main(arguments: list[str] | None = None) -> int:
    """Run a command; the exit status is 1 where it fails, with one line on what is wrong."""
    arguments = sys.argv[1:] if arguments is None else arguments
    stream, verb = sys.stderr, next((one for one in arguments if one in VERBS), "")
    try:
        options = _parser(verb, "--version" in arguments).parse_args(arguments)
        if "quiet" in options:  # no terminal, so that nobody draws a bar
            stream = SimpleNamespace(write=stream.write, flush=stream.flush, isatty=lambda: False)
            stream.quiet = True
        with redirect_stderr(stream):
            status = options.work(options) or 0
    except BrokenPipeError:
        status = 128 + signal.SIGPIPE
    except (ValueError, OSError) as error:
        line = str(error)
        if isinstance(error, OSError) and error.filename is not None:
            line = f"{error.filename}: {error.strerror}"
        for one in line.splitlines():
            print(f"error: {one}", file=sys.stderr)
        status = 1
    except ImportError as error:
        print(f"error: palpate {verb}: {_lacking(verb, error)}", file=sys.stderr)
        status = 1
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        # Nobody reads on, like head; the interpreter flushes once more as it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return status


def _lacking(verb: str, error: ImportError) -> str:
    """Which package, or which library of the system, a verb can't load, and what installs it."""
    if not isinstance(error, ModuleNotFoundError):
        return f"{error}; remedy: install that library by the system's packages"
    # Clouds as PCD files take Open3D whatever reads them.
    extra = "mesh" if error.name == "open3d" else VERBS[verb]
    package = f"palpate[{extra}]" if extra else "palpate"
    return f"expected {error.name}, found none; remedy: install {package}"


def _parser(verb: str, version: bool) -> argparse.ArgumentParser:
    parser = Parser(
        prog="palpate",
        description="How stiff soft things are: curves, recordings, captures, estimates.",
        epilog="palpate <command> --help ends with an example of it.",
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="command", title="commands")
    for name in [verb] if verb else () if version else VERBS:
        try:
            if missing := [one for one in SIGNS[VERBS[name]] if find_spec(one) is None]:
                raise ModuleNotFoundError(name=missing[0])
            import_module(f"palpate.commands.{MODULES.get(name, name)}").add(commands)
        except ImportError:
            if verb:
                raise
            commands.add_parser(name, help=f"needs palpate[{VERBS[name]}]")
    return parser


if __name__ == "__main__":
    sys.exit(main())
