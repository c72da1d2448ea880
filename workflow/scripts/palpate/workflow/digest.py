"""What a job depends on beside its inputs and options: code, versions of packages, folders.

Snakemake tracks a script's own text but not what it imports, nor what lies in a folder. All of it
goes into the ``params`` of each rule, so that a change re-runs what depends on it. Code counts by
package (``palpate.solid``, ``thesis.chapter5``): all that it ships, and all that it imports.
"""

import hashlib
import re
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

# Where the packages and the folders of scripts lie.
ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("palpate", "thesis", "validation", "virtual_lab")
# Counted by module: the service of the workflow, and the camera model, which the lab shares.
BY_MODULE = ("palpate.workflow.", "palpate.config.", "palpate.vision.camera.")
# What plans a run is no part of a job; packages name it as a type, or take objects' names from it.
PLANS = ("palpate.workflow.run.", "thesis.run.")
PIN = re.compile(r"^([A-Za-z0-9_.-]+)==([^\s\\;]+)", re.MULTILINE)
IMPORT = re.compile(r"^ *(?:from|import) +([\w.]+)(?: +import +(\([^)]*\)|.*))?", re.MULTILINE)


def follow(rules: Iterable, content: Callable, *, conda: str) -> None:
    """Give our scripts' rules an environment, ``code`` and, of a job's input, ``content``."""
    # In a module's user's workflow there are others.
    for rule in rules:
        script = ROOT / str(rule.script or "").rpartition("scripts/")[2]
        if script.is_file():
            digest = code(script, rule.params.get("make", ""))
            rule.conda_env = rule.conda_env or conda
            rule.set_params(code=digest, content=_by_wildcards(rule, content))


def _by_wildcards(rule: Any, content: Callable) -> Callable:
    """Param of a job's input that does not ask for it: Snakemake keeps none that does."""
    return lambda wildcards: content(wildcards, rule.expand_input(dict(wildcards.items()))[0])


def code(script: str | Path, make: str = "", root: Path = ROOT) -> str:
    """Digest what a script, or each of a folder, and a function ``module:function`` compute with.

    Sixteen hexadecimal digits; they change with any file of the packages that these import,
    directly or not, and with any pinned version.
    """
    found, waiting = set(), [Path(script)]
    waiting += _units(make.partition(":")[0], root)
    while waiting:
        if (unit := waiting.pop()) not in found:
            found.add(unit)
            waiting += _read(unit, root)[1]
    whole = [sorted(pins(root).items()), sorted(_read(unit, root)[0] for unit in found)]
    return hashlib.sha256(repr(whole).encode()).hexdigest()[:16]


def pins(root: Path = ROOT) -> dict[str, str]:
    """Version of each package that the project's lock pins."""
    return dict(PIN.findall((root.parents[1] / "environment.lock").read_text(encoding="utf-8")))


@cache
def _read(unit: Path, root: Path) -> tuple[str, set[Path]]:
    """Digest of a file, or of all below a folder, and what it imports of the packages."""
    digest, found = hashlib.sha256(), set()
    for path in sorted([unit, *unit.rglob("*")]):
        if path.is_file() and path.suffix != ".pyc":
            digest.update(f"{path.relative_to(root.parent)}\0".encode() + path.read_bytes() + b"\0")
            text = path.read_text(encoding="utf-8") if path.suffix == ".py" else ""
            for base, names in IMPORT.findall(text):
                if base.startswith(PACKAGES):
                    found |= {f"{base}.{name}" for name in re.findall(r"\w+", names) or [""]}
    return digest.hexdigest(), {path for name in found for path in _units(name, root)}


@cache
def _units(name: str, root: Path) -> list[Path]:
    """Folder or file that a dotted name counts as."""
    parts = name.split(".")
    if parts[0] in PACKAGES and not f"{name}.".startswith(PLANS):
        for k in range(2 + f"{name}.".startswith(BY_MODULE), len(parts) + 1):
            path = root.joinpath(*parts[:k])
            if path.with_suffix(".py").is_file() or path.is_dir():
                return [path if path.is_dir() else path.with_suffix(".py")]
    return []
