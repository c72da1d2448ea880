"""What object.yaml declares, for the scripts."""

from palpate.capture.schema import load_yaml
from palpate.run.job import naming
from palpate.solid.support import Support, read_support


def read_declared(path: str) -> tuple[dict, Support]:
    """Read object.yaml, and what the object stands on."""
    spec = load_yaml(path)
    with naming(path):
        return spec, read_support(spec["support"])
