"""Digest of a script's transitive imports: our modules' text, and the versions of others'.

Snakemake tracks a script's own text but not the modules it imports. The digest goes into the
rule's ``params``, so that an edit of the library, or another version of a package, re-runs just
what depends on it.
"""

import ast
import hashlib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import metadata
from pathlib import Path

PACKAGES = ("palpate", "virtual_lab", "thesis")
# Where the packages and the folders of scripts lie.
ROOT = Path(__file__).resolve().parents[2]


def code(script: str) -> str:
    """Digest of the modules that a script of the workflow imports, such as ``stages/mask``."""
    return code_digest(ROOT / f"{script}.py")


def function_code(make: str) -> str:
    """Digest of what `stages/artefact` makes with a function, named as ``module:function``.

    Of its module, of the script that writes what it returns, and of all that they import.
    """
    module = ROOT.joinpath(*make.partition(":")[0].split(".")).with_suffix(".py")
    script = ROOT / "stages" / "artefact.py"
    return _digest([script, module, *imported_modules(script), *imported_modules(module)])


def code_digest(script: str | Path, root: Path = ROOT) -> str:
    """Digest the modules that a script imports, directly or not.

    Parameters
    ----------
    script : path
    root : path, optional
        Folder of the packages.

    Returns
    -------
    str
        Sixteen hexadecimal digits that change when any of those modules changes, or the version of
        a package that one of them imports.
    """
    return _digest(imported_modules(script, root), script=Path(script))


def _digest(modules: Iterable[Path], script: Path | None = None) -> str:
    modules, digest = sorted(set(modules)), hashlib.sha256()
    for module in modules:
        digest.update(module.name.encode() + b"\0" + module.read_bytes() + b"\0")
    # Snakemake tracks a script's text, not the packages that it names.
    sources = [*modules, script] if script else modules
    names = {name.partition(".")[0] for source in sources for name in _imported_names(source)}
    for name in sorted(names):
        digest.update(f"{name} {_version(name)}\0".encode())
    return digest.hexdigest()[:16]


@cache
def _version(name: str) -> str:
    """Version of the packages that an imported name comes from, empty for Python's own and ours."""
    packages = sorted(set(_packages().get(name, ())))
    return " ".join(f"{package} {metadata.version(package)}" for package in packages)


@cache
def _packages() -> Mapping[str, list[str]]:
    return metadata.packages_distributions()


def imported_modules(script: str | Path, root: Path = ROOT) -> list[Path]:
    """List the packages' files that a script imports, directly or not, in path order."""
    script = Path(script)
    found: set[Path] = set()
    waiting = list(_local_imports(script, root))
    while waiting:
        module = waiting.pop()
        if module not in found:
            found.add(module)
            waiting.extend(_local_imports(module, root))
    return sorted(found)


@cache
def _local_imports(source: Path, root: Path) -> tuple[Path, ...]:
    return tuple(path for name in _imported_names(source) for path in _files_of(name, root))


@cache
def _imported_names(source: Path) -> tuple[str, ...]:
    """Dotted names that a file imports."""
    names = []
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(names)


def _files_of(name: str, root: Path) -> list[Path]:
    """Files that importing a dotted name runs: the packages on the way and the module itself."""
    parts = name.split(".")
    if parts[0] not in PACKAGES:
        return []
    folders = [root.joinpath(*parts[: k + 1]) for k in range(len(parts))]
    # The topmost only says what its modules are, and the version: no result follows from it.
    packages = [folder / "__init__.py" for folder in folders[1:]]
    module = folders[-1].with_suffix(".py")
    return [path for path in [*packages, module] if path.is_file()]
