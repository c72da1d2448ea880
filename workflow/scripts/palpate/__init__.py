"""Palpate: elastic moduli of soft objects from one depth camera and a hand-held force probe.

Names are loaded when they are asked for: jobs that need one room need not wait for the others.
"""

from importlib import import_module
from typing import Any

__version__ = "1.0.0"

# What the public names are: of modules, and the modules themselves.
_NAMES = {
    "Capture": "palpate.capture.capture",
    "open_capture": "palpate.capture.capture",
    "check_object": "palpate.capture.check",
    "Config": "palpate.workflow.options",
    "Measurement": "palpate.measurement",
    "measure": "palpate.measurement",
    "solid_of": "palpate.measurement",
    "indentation_table": "palpate.measurement",
    "track": "palpate.measurement",
    "IndentationTable": "palpate.solid.options",
    "Support": "palpate.solid.support",
    "read_solid": "palpate.solid.mesh",
    "indentation_model": "palpate.solid.load_steps",
    "ElasticTracking": "palpate.surface.options",
    "lame_from_engineering": "palpate.solid.laws",
    "engineering_from_lame": "palpate.solid.laws",
    "reduced_modulus": "palpate.solid.laws",
    "StiffnessMap": "palpate.point_map",
    "stiffness_map": "palpate.point_map",
    "own_part": "palpate.point_map",
}
_MODULES = ("hertz", "direct", "noise", "plan")
__all__ = ["__version__", *_NAMES, *_MODULES]


def __getattr__(name: str) -> Any:
    if name in _NAMES:
        return getattr(import_module(_NAMES[name]), name)
    if name in _MODULES:
        return import_module(f"palpate.{name}")
    raise AttributeError(f"module 'palpate' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
