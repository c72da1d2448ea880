"""The command ``palpate import``: captures made of recordings of other software."""

import argparse
from typing import Any

from palpate.capture.importing import command
from palpate.commands.help import add_verb

ABOUT = """\
Make a capture of a recording: a ROS bag, a RealSense recording, or a folder with rgb.txt and
depth.txt (docs/importing.md).
"""


def _import(options: argparse.Namespace) -> None:
    print("\n".join(command.run(options)))


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    verb = add_verb(
        commands,
        "import",
        "make a capture of a recording",
        _import,
        about=ABOUT,
        example="palpate import press.bag raw/sponge/d435/08",
    )
    command.add_options(verb)
