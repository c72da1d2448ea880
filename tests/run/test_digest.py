"""The digest follows a script's local imports, and nothing else."""

import pytest
from palpate.run.digest import code_digest, imported_modules


@pytest.fixture
def tree(tmp_path):
    package = tmp_path / "palpate" / "solid"
    package.mkdir(parents=True)
    (tmp_path / "palpate" / "__init__.py").write_text('"""Top."""\n')
    (package / "__init__.py").write_text('"""Solid."""\n')
    (package / "mesh.py").write_text("import numpy\n")
    (package / "load.py").write_text("from palpate.solid.mesh import x\n")
    (package / "other.py").write_text("y = 1\n")
    script = tmp_path / "stage.py"
    script.write_text("import beside\nfrom palpate.solid.load import z\n")
    return script


def names(script):
    found = imported_modules(script, script.parent)
    return [str(path.relative_to(script.parent)) for path in found]


def test_follows_imports_of_imports(tree):
    assert names(tree) == [
        "palpate/solid/__init__.py",
        "palpate/solid/load.py",
        "palpate/solid/mesh.py",
    ]


@pytest.mark.parametrize(("module", "changes"), [("mesh", True), ("other", False)])
def test_changes_with_what_is_imported_only(tree, module, changes):
    before = code_digest(tree, tree.parent)
    path = tree.parent / "palpate" / "solid" / f"{module}.py"
    path.write_text(path.read_text() + "a = 2\n")
    # Imports are read once a process: a new run of the workflow reads them anew.
    from palpate.run import digest

    digest._local_imports.cache_clear()
    assert (code_digest(tree, tree.parent) != before) is changes


def test_resolves_relative_imports(tree):
    (tree.parent / "palpate" / "solid" / "load.py").write_text("from .mesh import x\n")
    assert "palpate/solid/mesh.py" in names(tree)
