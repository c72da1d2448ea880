"""Digest of a script's transitive local imports.

Snakemake tracks a script's own text but not the modules it imports. The digest goes into the
rule's ``params``, so that an edit of the library re-runs just what depends on it.
"""

import ast
import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

PACKAGES = ("palpate", "virtual_lab", "thesis")
# Where the packages and the folders of scripts lie.
ROOT = Path(__file__).resolve().parents[2]


def code(script: str) -> str:
    """Digest of the modules that a script of the workflow imports, such as ``stages/mask``."""
    return code_digest(ROOT / f"{script}.py")


def function_code(make: str) -> str:
    """Digest of a function's module, named as ``module:function``, and of all that it imports."""
    module = ROOT.joinpath(*make.partition(":")[0].split(".")).with_suffix(".py")
    return _digest([module, *imported_modules(module)])


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
        Sixteen hexadecimal digits that change when any of those modules changes.
    """
    return _digest(imported_modules(script, root))


def _digest(modules: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for module in sorted(set(modules)):
        digest.update(module.name.encode() + b"\0" + module.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


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
    names = []
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = _absolute_name(node, source, root)
            names += [base, *(f"{base}.{alias.name}" for alias in node.names)]
    return tuple(path for name in names for path in _files_of(name, root))


def _absolute_name(node: ast.ImportFrom, source: Path, root: Path) -> str:
    if not node.level:
        return node.module or ""
    package = source.relative_to(root).parent.parts
    parts = package[: len(package) - node.level + 1]
    return ".".join([*parts, *([node.module] if node.module else [])])


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
