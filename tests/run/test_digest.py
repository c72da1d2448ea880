"""The digest follows a script's local imports, and nothing else."""

import pytest
from palpate.run.digest import ROOT, code_digest, imported_modules


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

    digest._imported_names.cache_clear()
    digest._local_imports.cache_clear()
    assert (code_digest(tree, tree.parent) != before) is changes


def test_changes_with_the_versions_of_what_is_imported(tree, monkeypatch):
    """An upgrade of NumPy runs again what imports it, and one of another package nothing."""
    from palpate.run import digest

    def with_version_of(package):
        digest._version.cache_clear()
        real = digest.metadata.version
        with monkeypatch.context() as changed:
            changed.setattr(
                digest.metadata, "version", lambda name: "9" if name == package else real(name)
            )
            return code_digest(tree, tree.parent)

    before = with_version_of("none")
    assert with_version_of("numpy") != before
    assert with_version_of("scipy") == before
    (tree.parent / "stage.py").write_text(tree.read_text() + "import scipy.linalg\n")
    digest._imported_names.cache_clear()
    digest._local_imports.cache_clear()
    before = with_version_of("none")
    assert with_version_of("scipy") != before
    digest._version.cache_clear()


def test_an_artefact_depends_on_what_writes_it(monkeypatch):
    """Script and writers are those of all artefacts."""
    from palpate.run import digest

    held = set()
    monkeypatch.setattr(digest, "_digest", lambda modules, script=None: held.update(modules))
    digest.function_code("palpate.report.moduli_figure:make_direct_moduli")
    names = {path.relative_to(ROOT).as_posix() for path in held}
    assert {"stages/artefact.py", "palpate/report/outputs.py", "palpate/capture/files.py"} <= names
