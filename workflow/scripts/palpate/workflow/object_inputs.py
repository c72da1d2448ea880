"""What stages read of an object."""

from typing import Any

from palpate.solid.support import Support, read_support
from palpate.surface.template import Template, read_template
from palpate.workflow.job import naming
from palpate.yaml_files import load_yaml


def read_declared(path: str) -> tuple[dict, Support]:
    """Read object.yaml, and what the object stands on."""
    spec = load_yaml(path)
    with naming(path):
        return spec, read_support(spec["support"])


def read_object(inputs: Any) -> tuple[dict, Support, Template]:
    """Read the files ``object`` and ``template``: also what the object stands on."""
    spec, support = read_declared(inputs.object)
    return spec, support, read_template(inputs.template, unit=spec["template"]["unit"])
