"""The digest follows a script's local imports and the versions of packages, and nothing else."""

import json
import subprocess
import sys

import pytest
from palpate.run import digest
from palpate.run.digest import code, imported_modules, whole_code

# Rules of a Snakefile with a script and the names of their params, without running anything.
RULES = """
import json, sys
from pathlib import Path
from snakemake.api import SnakemakeApi
from snakemake.settings.types import ConfigSettings, OutputSettings, ResourceSettings

file, config = Path(sys.argv[1]), json.loads(sys.argv[2])
with SnakemakeApi(OutputSettings()) as api:
    flow = api.workflow(
        ResourceSettings(cores=1), config_settings=ConfigSettings(config=config), snakefile=file
    )
    rules = [rule for rule in flow._workflow.rules if rule.script]
    print(json.dumps({rule.name: list(rule.params.keys()) for rule in rules}))
"""
LOCK = "numpy==1.26.4 \\\n    --hash=sha256:00\n    # via scipy\n"


@pytest.fixture
def tree(tmp_path):
    """Folder of the packages of a project."""
    root = tmp_path / "workflow/scripts"
    package = root / "palpate/solid"
    package.mkdir(parents=True)
    (tmp_path / "environment.lock").write_text(LOCK)
    (root / "palpate/__init__.py").write_text('"""Top."""\n')
    (package / "__init__.py").write_text('"""Solid."""\n')
    (package / "mesh.py").write_text("import numpy\n")
    (package / "load.py").write_text("from palpate.solid.mesh import x\n")
    (package / "other.py").write_text("y = 1\n")
    (root / "stage.py").write_text("import beside\nfrom palpate.solid.load import z\n")
    return root


@pytest.fixture(autouse=True)
def read_anew():
    """Imports are read once a process: a new run of the workflow reads them anew."""
    digest._local_imports.cache_clear()


def names(root):
    return [str(path.relative_to(root)) for path in imported_modules(root / "stage.py", root)]


def test_follows_imports_of_imports(tree):
    assert names(tree) == [
        "palpate/solid/__init__.py",
        "palpate/solid/load.py",
        "palpate/solid/mesh.py",
    ]


@pytest.mark.parametrize(("module", "changes"), [("mesh", True), ("other", False)])
def test_changes_with_what_is_imported_only(tree, module, changes):
    before = code(tree / "stage.py", root=tree)
    path = tree / "palpate/solid" / f"{module}.py"
    path.write_text(path.read_text() + "a = 2\n")
    assert (code(tree / "stage.py", root=tree) != before) is changes


@pytest.mark.parametrize("edited", ["other", "mesh"])
def test_a_function_and_the_script_that_writes_for_it_both_count(tree, edited):
    make = "palpate.solid.other:function"
    before = code(tree / "stage.py", make, root=tree)
    path = tree / "palpate/solid" / f"{edited}.py"
    path.write_text(path.read_text() + "a = 2\n")
    assert code(tree / "stage.py", make, root=tree) != before


@pytest.mark.parametrize(
    ("before", "after", "changes"),
    [("1.26.4", "1.26.5", True), ("# via scipy", "# via pandas", False), (":00", ":01", False)],
)
def test_a_version_counts_and_a_comment_does_not(tree, before, after, changes):
    found = [digest_of(tree) for digest_of in (of_stage, whole_code)]
    lock = tree.parents[1] / "environment.lock"
    lock.write_text(lock.read_text().replace(before, after))
    again = [digest_of(tree) for digest_of in (of_stage, whole_code)]
    assert [one != other for one, other in zip(found, again, strict=True)] == [changes] * 2


def of_stage(root):
    return code(root / "stage.py", root=root)


def test_an_objects_own_run_follows_the_whole_project(tree):
    first = whole_code(tree)
    (tree.parents[1] / "README.md").write_text("no part of what computes")
    assert whole_code(tree) == first
    (tree / "palpate/solid/other.py").write_text("y = 2\n")
    assert whole_code(tree) != first


def test_resolves_relative_imports(tree):
    (tree / "palpate/solid/load.py").write_text("from .mesh import x\n")
    assert "palpate/solid/mesh.py" in names(tree)


@pytest.mark.workflow
@pytest.mark.parametrize(
    ("file", "paths", "count"),
    [
        ("workflow/Snakefile", {"raw": "results/none"}, 90),
        ("workflow/objects.smk", {"raw": "tests/sample/raw", "sensors": "tests/sample/sensors"}, 4),
    ],
)
def test_every_rule_depends_on_its_code_and_its_folders(root, file, paths, count):
    command = [sys.executable, "-c", RULES, file, json.dumps({"paths": paths})]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    rules = json.loads(done.stdout)
    assert len(rules) >= count
    assert [name for name, params in rules.items() if not {"code", "content"} <= set(params)] == []
