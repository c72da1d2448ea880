"""What people get to see: tables, figures and pages."""

from pathlib import Path

import yaml

TEMPLATES = Path(__file__).parent / "templates"


def texts(name: str) -> dict:
    """Texts of a YAML file beside the templates of pages."""
    return yaml.safe_load((TEMPLATES / f"{name}.yaml").read_text(encoding="utf-8"))
