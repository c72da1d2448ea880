"""What a job depends on beside its inputs and options: code, versions of packages, folders.

Snakemake tracks a script's own text but not the modules it imports, what these compute with, nor
what lies in a folder. All of it goes into the ``params`` of each rule, so that a change re-runs
just what depends on it.
"""

import ast
import hashlib
import re
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

PACKAGES = ("palpate", "virtual_lab", "thesis")
# Where the packages and the folders of scripts lie.
ROOT = Path(__file__).resolve().parents[2]
# What the run of an object by itself may use, below the project.
WHOLE = ("workflow/Snakefile", "workflow/rules", "workflow/scripts", "config/published")
PIN = re.compile(r"^([A-Za-z0-9_.-]+)==([^\s\\;]+)", re.MULTILINE)


def follow(rules: Iterable, content: Callable) -> None:
    """Give the project's rules the params ``code`` and ``content``.

    Parameters
    ----------
    rules : iterable of Snakemake's rules
        Those without a script of the project, or that have the params, stay as they are.
    content : callable
        Takes a job's wildcards and input; tells states of folders apart.
    """
    for rule in rules:
        script = ROOT / str(rule.script or "").rpartition("scripts/")[2]
        if script.is_file() and "code" not in rule.params.keys():
            digest = code(script, rule.params.get("make", ""))
            rule.set_params(code=digest, content=_by_wildcards(rule, content))


def _by_wildcards(rule, content: Callable) -> Callable:
    """Param of a job's input that says so to nobody: Snakemake keeps none that asks for it."""

    def told(wildcards: Any) -> Any:
        files, *_ = rule.expand_input(dict(wildcards.items()))
        return content(wildcards, files)

    return told


def code(script: str | Path, make: str = "", root: Path = ROOT) -> str:
    """Digest what a script computes with.

    Parameters
    ----------
    script : path
    make : str, optional
        ``module:function`` that it calls.
    root : path, optional
        Folder of the packages, ``workflow/scripts`` of a project.

    Returns
    -------
    str
        Sixteen hexadecimal digits that change when any module changes that script or function
        import, directly or not, or any pinned version: which packages a result hangs on through
        other packages nobody can tell.
    """
    modules = set(imported_modules(script, root))
    if make:
        module = root.joinpath(*make.partition(":")[0].split(".")).with_suffix(".py")
        modules |= {module, *imported_modules(module, root)}
    return _digest(modules, root)


def whole_code(root: Path = ROOT, apart: Iterable[str] = ()) -> str:
    """Digest all that the workflow computes with, as `code` does, but for some files or folders."""
    places = [root.parents[1] / name for name in WHOLE]
    files = {path for place in places for path in (place, *place.rglob("*")) if path.is_file()}
    left = {path for path in files if any(path.is_relative_to(root.parent / one) for one in apart)}
    return _digest((path for path in files - left if path.suffix != ".pyc"), root)


def pins(root: Path = ROOT) -> dict[str, str]:
    """Version of each package that the project's lock pins."""
    return dict(PIN.findall((root.parents[1] / "environment.lock").read_text(encoding="utf-8")))


def _digest(files: Iterable[Path], root: Path) -> str:
    digest = hashlib.sha256(repr(sorted(pins(root).items())).encode())
    for path in sorted(files):
        digest.update(f"{path.relative_to(root.parents[1])}\0".encode() + path.read_bytes() + b"\0")
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
