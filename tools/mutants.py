"""Change one operator or constant of a package at a time, and see whether its tests notice.

``make mutants`` draws mutants at random and says what killed each; the exit status is 1 when more
than a tenth survive. Each is judged in a copy of the project by the quick tests of its package, of
which those that name the changed module come first; errors and time-outs kill.
"""

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS = "workflow/scripts"
PACKAGES = ("vision", "solid", "estimate")
LEFT_OUT = {".git", ".venv", ".snakemake", "raw", "results", "validation", "protocols"}
MOST_SURVIVORS = 0.1
# Of what the tests of a package take without mutants, and what they are given beside.
PATIENCE, START_S = 5, 60
SHOWN = 40

# A comparison is turned round: at its boundary alone floats cannot tell.
NODES = "Add-Sub Mult-Div And-Or BitAnd-BitOr Lt-GtE Gt-LtE Eq-NotEq Is-IsNot In-NotIn"
NAMES = "min-max minimum-maximum argmin-argmax nanmin-nanmax"
PAIRS = [tuple(getattr(ast, name) for name in pair.split("-")) for pair in NODES.split()]
PAIRS += [tuple(pair.split("-")) for pair in NAMES.split()]
OTHERS = {a: b for pair in PAIRS for a, b in (pair, pair[::-1])}
OTHERS |= dict.fromkeys((ast.Pow, ast.FloorDiv, ast.Mod, ast.MatMult), ast.Mult)
# Messages; defaults of options, which docs/options.md is held to; zip's word that lengths agree.
SPARED = (ast.JoinedStr, ast.Raise)
SPARED_FIELDS = {"annotation", "returns", "decorator_list"}
SPARED_NAMES = {"option", "constant", "strict"}
# Smaller numbers keep from dividing by 0: one is as good as another.
NOTHING = 1e-100


def places(node: ast.AST) -> Iterator[tuple[int, Callable[[], None]]]:
    """What can be changed: its line, and the change."""
    for field, value in ast.iter_fields(node):
        children = value if isinstance(value, list) else [value]
        for at, child in enumerate([] if field in SPARED_FIELDS else children):
            if not isinstance(child, ast.AST) or _spared(child):
                continue
            if (new := _changed(child)) is not None:
                place = child if hasattr(child, "lineno") else node
                yield place.lineno, _put(node, field, at, new)
            yield from places(child)


def _spared(node: ast.AST) -> bool:
    name = getattr(getattr(node, "func", None), "id", getattr(node, "arg", None))
    return isinstance(node, SPARED) or name in SPARED_NAMES


def _changed(node: ast.AST) -> ast.AST | None:
    match node:
        case ast.Constant(value=bool(value)):
            return ast.Constant(not value)
        case ast.Constant(value=int(value)):
            return ast.Constant(1 - value if value in (0, 1) else value + 1)
        case ast.Constant(value=float(value)) if not 0 < value < NOTHING:
            return ast.Constant(1.1 * value or 1.0)
        case ast.UnaryOp(op=ast.USub() | ast.Not() | ast.Invert()):
            return node.operand
        case ast.Name(id=name) if name in OTHERS:
            return ast.Name(OTHERS[name], node.ctx)
        case ast.Attribute(attr=name) if name in OTHERS:
            return ast.Attribute(node.value, OTHERS[name], node.ctx)
        case _ if type(node) in OTHERS:
            return OTHERS[type(node)]()
    return None


def _put(node: ast.AST, field: str, at: int, new: ast.AST) -> Callable[[], None]:
    value = getattr(node, field)
    if isinstance(value, list):
        return lambda: value.__setitem__(at, new)
    return lambda: setattr(node, field, new)


def mutated(text: str, index: int) -> tuple[int, str, str, str]:
    """Line of a place, code before and after there, and the whole text."""
    tree = ast.parse(text)
    before = ast.unparse(tree)
    line, change = list(places(tree))[index]
    change()
    after = ast.unparse(tree)
    lines = zip(before.splitlines(), after.splitlines(), strict=True)
    here, there = next(pair for pair in lines if pair[0] != pair[1])
    return line, here.strip(), there.strip(), after


def _about(before: str, after: str) -> str:
    """The difference of two lines, with what stands around it."""
    same = len(os.path.commonprefix([before, after]))  # noqa: RUF071 - no paths
    part = slice(max(same - SHOWN, 0), same + SHOWN)
    return f"{before[part]}  ->  {after[part]}"


class Package:
    """A package in a copy of the project."""

    def __init__(self, name: str, copy: Path):
        self.name, self.copy = name, copy
        files = sorted((copy / SCRIPTS / "palpate" / name).rglob("*.py"))
        self.texts = {str(file.relative_to(copy / SCRIPTS)): file.read_text() for file in files}
        began = perf_counter()
        self._require_passing()
        self.limit_s = START_S + PATIENCE * (perf_counter() - began)

    def mutants(self) -> list[tuple["Package", str, int]]:
        """All that can be drawn: package, file and place."""
        counts = {file: len(list(places(ast.parse(text)))) for file, text in self.texts.items()}
        return [(self, file, index) for file in counts for index in range(counts[file])]

    def judged(self, file: str, index: int) -> tuple[str, str]:
        """A mutant in words, and how it ended."""
        line, before, after, text = mutated(self.texts[file], index)
        words = f"{file.removeprefix('palpate/')}:{line}  {_about(before, after)}"
        (self.copy / SCRIPTS / file).write_text(text)
        try:
            done = self._pytest(self._tests(file), timeout=self.limit_s)
        except subprocess.TimeoutExpired:
            return words, f"killed by the time of {self.limit_s:.0f} s"
        finally:
            (self.copy / SCRIPTS / file).write_text(self.texts[file])
        if done.returncode == 0:
            return words, "SURVIVED"
        failed = re.search(r"^(?:FAILED|ERROR) tests/(\S+)", done.stdout, re.MULTILINE)
        return words, f"killed by {failed[1] if failed else 'the import'}"

    def _require_passing(self) -> None:
        done = self._pytest(self._tests(""))
        if done.returncode:
            raise ValueError(f"tests/{self.name}: expected to pass, found\n{done.stdout[-2000:]}")

    def _tests(self, file: str) -> list[str]:
        """Test files of the package, those that name a module first."""
        module = file.removesuffix(".py").replace("/", ".")
        found = sorted((self.copy / "tests" / self.name).rglob("test_*.py"))
        first = sorted(found, key=lambda path: module not in path.read_text())
        return [str(path.relative_to(self.copy)) for path in first]

    def _pytest(self, tests: Sequence[str], **more) -> subprocess.CompletedProcess:
        own = {"PYTHONPATH": SCRIPTS, "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-rfE", "-p", "no:cacheprovider"]
        return subprocess.run(
            [*command, *tests],
            cwd=self.copy,
            env=os.environ | own,
            capture_output=True,
            text=True,
            check=False,
            **more,
        )


def survivors(
    root: Path,
    packages: Sequence[str],
    *,
    count: int,
    seed: int,
    say: Callable[[str], object] = print,
) -> tuple[int, int]:
    """Judge mutants drawn at random; how many survive, and how many were drawn."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Path(folder) / root.name
        shutil.copytree(root, copy, ignore=lambda at, _: LEFT_OUT if Path(at) == root else [])
        every = [one for name in packages for one in Package(name, copy).mutants()]
        drawn = random.Random(seed).sample(every, min(count, len(every)))
        lived = 0
        for package, file, index in sorted(drawn, key=every.index):
            began = perf_counter()
            words, end = package.judged(file, index)
            say(f"{words}\n    {end} ({perf_counter() - began:.0f} s)")
            lived += end == "SURVIVED"
    say(f"{lived} of {len(drawn)} survive")
    return lived, len(drawn)


def main() -> int:
    """Judge the wanted mutants."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--packages", nargs="+", choices=PACKAGES, default=PACKAGES)
    options = parser.parse_args()
    say = partial(print, flush=True)
    how_many = {"count": options.count, "seed": options.seed}
    lived, drawn = survivors(ROOT, options.packages, **how_many, say=say)
    return int(lived > MOST_SURVIVORS * drawn)


if __name__ == "__main__":
    sys.exit(main())
