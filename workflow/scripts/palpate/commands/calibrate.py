"""The command ``palpate calibrate``: what of a rig must be measured before the objects are."""

from typing import Any

from palpate.commands import calibrate_camera, calibrate_probe

# In the order in which a person needs them.
PARTS = (calibrate_camera, calibrate_probe)


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    about = "Measure the rig itself: its cameras, the probe's tip, its load and stiffness."
    verb = commands.add_parser(
        "calibrate", help="measure the rig: cameras, probe", description=about
    )
    parts = verb.add_subparsers(required=True, metavar="part", title="parts")
    for part in PARTS:
        part.add(parts)
