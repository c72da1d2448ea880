"""The table of artefacts: each entry once, with a function, a caption, and a light import."""

import subprocess
import sys
from importlib import import_module
from types import SimpleNamespace

import pytest
from docutils.core import publish_parts
from jinja2 import Environment
from palpate.workflow.digest import ROOT
from thesis.artefacts import ARTEFACTS

SHOWN = [entry for entry in ARTEFACTS if entry.wanted]


def test_names_and_files_are_each_entrys_own():
    names = [entry.name for entry in ARTEFACTS]
    files = [path for entry in ARTEFACTS for path in entry.outputs.values()]
    assert len(set(names)) == len(names) > 80
    assert len(set(files)) == len(files)


def test_functions_are_there():
    for make in {entry.make for entry in ARTEFACTS}:
        module, _, name = make.partition(":")
        assert callable(getattr(import_module(module), name))


@pytest.mark.parametrize("entry", SHOWN, ids=lambda entry: entry.name)
def test_captions_are_titled_render_and_say_where_data_come_from(root, entry):
    text = (root / "workflow/report/caption.rst").read_text()
    template = Environment(trim_blocks=True, lstrip_blocks=True).from_string(text)
    captures = [{"provenance": "simulated"}] if entry.captures else None
    params = {"title": entry.title, "caption": entry.caption, "captures": captures}
    job = {"params": params, "output": dict(entry.outputs), "wildcards": {}}
    shown = template.render(snakemake=SimpleNamespace(**job))
    parts = publish_parts(shown, writer="html", settings_overrides={"halt_level": 2})
    assert parts["title"] == entry.title.replace("'", "’").replace("’", "'")
    assert len(parts["body"]) > 40
    assert entry.category
    if entry.captures:
        assert "simulated" in shown


def test_the_table_costs_no_library():
    """Every Snakemake process reads it."""
    heavy = "{'matplotlib', 'open3d', 'cv2', 'trimesh', 'scipy'}"
    code = f"import sys, thesis.artefacts; sys.exit(str({heavy} & set(sys.modules) or ''))"
    done = subprocess.run(
        [sys.executable, "-c", code], env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True
    )
    assert done.stderr.strip() == ""
