"""Change one operator or constant of a room at a time, and see whether its tests tell.

``make mutants`` draws mutants at random and says what killed each; the exit status is 1 when more
than a tenth survive. Each is run in a copy of the project with the quick tests of its room that
reach its statement, which one run with marked statements tells. What no test reaches survives;
errors and time-outs kill.
"""

import argparse
import ast
import builtins
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS = "workflow/scripts"
ROOMS = ("vision", "solid", "estimate")
LEFT_OUT = {".git", ".venv", ".snakemake", "raw", "results", "validation", "manners"}
MOST_SURVIVORS = 0.1
# Of what a mutant's tests take without it, and what they are given beside.
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
SPARED_NAMES = {"option", "block", "strict"}
# Smaller numbers keep from dividing by 0: one is as good as another.
NOTHING = 1e-100


def places(node: ast.AST, line: int = 0) -> Iterator[tuple[int, int, Callable[[], None]]]:
    """What can be changed: its line, that of its statement (0 outside functions), the change."""
    for field, value in ast.iter_fields(node):
        children = value if isinstance(value, list) else [value]
        for at, child in enumerate([] if field in SPARED_FIELDS else children):
            if not isinstance(child, ast.AST) or _spared(child):
                continue
            begins = isinstance(child, ast.stmt) and (line or isinstance(node, ast.FunctionDef))
            here = child.lineno if begins else line
            if (new := _changed(child)) is not None:
                place = child if hasattr(child, "lineno") else node
                yield place.lineno, here, _put(node, field, at, new)
            yield from places(child, here)


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


def mutated(text: str, index: int) -> tuple[int, int, str, str, str]:
    """Lines of a place and its statement, code before and after there, and the whole text."""
    tree = ast.parse(text)
    before = ast.unparse(tree)
    line, statement, change = list(places(tree))[index]
    change()
    after = ast.unparse(tree)
    lines = zip(before.splitlines(), after.splitlines(), strict=True)
    here, there = next(pair for pair in lines if pair[0] != pair[1])
    return line, statement, here.strip(), there.strip(), after


def _about(before: str, after: str) -> str:
    """The difference of two lines, with what stands around it."""
    same = len(os.path.commonprefix([before, after]))  # noqa: RUF071 - no paths
    part = slice(max(same - SHOWN, 0), same + SHOWN)
    return f"{before[part]}  ->  {after[part]}"


class Marked(ast.NodeTransformer):
    """Tells of each statement in a function that it was reached."""

    def __init__(self, name: str):
        self.name, self.inside = name, False

    def visit(self, node: ast.AST) -> ast.AST | list[ast.AST]:
        before, self.inside = self.inside, self.inside or isinstance(node, ast.FunctionDef)
        node, self.inside = self.generic_visit(node), before
        if not (before and isinstance(node, ast.stmt)):
            return node
        return [*ast.parse(f"_reached('{self.name}:{node.lineno}')").body, node]


# As a plugin of pytest (-p mutants) this module notes what each test reaches, and its time.
NOW, ALWAYS = set(), set()
IN_SETUP, TESTS = defaultdict(set), defaultdict(lambda: {"seconds": 0.0, "reached": set()})
builtins._reached = NOW.add


def pytest_collection_finish() -> None:
    """What modules call when they are imported counts for all tests."""
    ALWAYS.update(NOW)
    NOW.clear()


def pytest_runtest_logreport(report) -> None:
    """What fixtures reach counts for all tests of the file."""
    test = TESTS[report.nodeid]
    test["seconds"] += report.duration
    place = IN_SETUP[_file(report.nodeid)] if report.when == "setup" else test["reached"]
    place.update(NOW)
    NOW.clear()


def pytest_sessionfinish() -> None:
    """Write it where the caller wants it."""
    if place := os.environ.get("REACHED"):
        for name, test in TESTS.items():
            test["reached"] = sorted(test["reached"] | IN_SETUP[_file(name)] | ALWAYS)
        Path(place).write_text(json.dumps(TESTS))


def _file(test: str) -> str:
    return test.split("::")[0]


class Room:
    """A room in a copy of the project."""

    def __init__(self, name: str, copy: Path):
        self.name, self.copy = name, copy
        files = sorted((copy / SCRIPTS / "palpate" / name).rglob("*.py"))
        self.texts = {str(file.relative_to(copy / SCRIPTS)): file.read_text() for file in files}

    def mutants(self) -> list[tuple["Room", str, int]]:
        """All that can be drawn: room, file and place."""
        counts = {file: len(list(places(ast.parse(text)))) for file, text in self.texts.items()}
        return [(self, file, index) for file in counts for index in range(counts[file])]

    @cached_property
    def tests(self) -> dict[str, dict]:
        """Seconds of each test, and the statements that it reaches."""
        for file, text in self.texts.items():
            marked = ast.fix_missing_locations(Marked(file).visit(ast.parse(text)))
            self._write(file, ast.unparse(marked))
        done = self._pytest([f"tests/{self.name}"], "-p", "mutants")
        for file, text in self.texts.items():
            self._write(file, text)
        if done.returncode:
            raise ValueError(f"tests/{self.name}: expected to pass, found\n{done.stdout[-2000:]}")
        return json.loads((self.copy / "reached.json").read_text())

    def judged(self, file: str, index: int) -> tuple[str, str]:
        """A mutant in words, and how it ended."""
        line, statement, before, after, text = mutated(self.texts[file], index)
        names = self._reaching(file, statement)
        words = f"{file.removeprefix('palpate/')}:{line}  {_about(before, after)}"
        if not names:
            return words, "SURVIVED: no test reaches it"
        self._write(file, text)
        try:
            limit_s = START_S + PATIENCE * sum(self.tests[name]["seconds"] for name in names)
            done = self._pytest(names, "-x", timeout=limit_s)
        except subprocess.TimeoutExpired:
            return words, f"killed by the time of {limit_s:.0f} s"
        finally:
            self._write(file, self.texts[file])
        if done.returncode == 0:
            return words, f"SURVIVED {len(names)} tests"
        failed = re.search(r"^(?:FAILED|ERROR) tests/(\S+)", done.stdout, re.MULTILINE)
        return words, f"killed by {failed[1] if failed else 'the import'}"

    def _reaching(self, file: str, statement: int) -> list[str]:
        # Module's lines serve the module and those that import from it.
        module = file.removesuffix(".py").replace("/", ".")
        users = [one for one, text in self.texts.items() if one == file or f"{module} " in text]
        marks = {f"{file}:{statement}"} if statement else {f"{user}:" for user in users}
        names = [
            name
            for name, test in self.tests.items()
            if any(one in marks or one[: one.index(":") + 1] in marks for one in test["reached"])
        ]
        seconds = defaultdict(float)
        for name in names:
            seconds[_file(name)] += self.tests[name]["seconds"]
        return sorted(names, key=lambda name: seconds[_file(name)])

    def _write(self, file: str, text: str) -> None:
        (self.copy / SCRIPTS / file).write_text(text)

    def _pytest(self, what: Sequence[str], *options: str, **more) -> subprocess.CompletedProcess:
        own = {
            "PYTHONPATH": f"{SCRIPTS}:tests:tools",
            "PYTHONDONTWRITEBYTECODE": "1",
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            "REACHED": "reached.json",
        }
        command = [sys.executable, "-m", "pytest", "-q", "-rfE", "-p", "no:cacheprovider"]
        return subprocess.run(
            [*command, *options, *what],
            cwd=self.copy,
            env=os.environ | own,
            capture_output=True,
            text=True,
            check=False,
            **more,
        )


def survivors(
    root: Path, rooms: Sequence[str], *, count: int, seed: int, say: Callable[[str], object] = print
) -> tuple[int, int]:
    """Judge mutants drawn at random; how many survive, and how many were drawn."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Path(folder) / root.name
        shutil.copytree(root, copy, ignore=lambda at, _: LEFT_OUT if Path(at) == root else [])
        every = [one for room in rooms for one in Room(room, copy).mutants()]
        drawn = random.Random(seed).sample(every, min(count, len(every)))
        lived = 0
        for room, file, index in sorted(drawn, key=every.index):
            began = perf_counter()
            words, end = room.judged(file, index)
            say(f"{words}\n    {end} ({perf_counter() - began:.0f} s)")
            lived += end.startswith("SURVIVED")
    say(f"{lived} of {len(drawn)} survive")
    return lived, len(drawn)


def main() -> int:
    """Judge the wanted mutants."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--rooms", nargs="+", choices=ROOMS, default=ROOMS)
    options = parser.parse_args()
    say = partial(print, flush=True)
    lived, drawn = survivors(ROOT, options.rooms, count=options.count, seed=options.seed, say=say)
    return int(lived > MOST_SURVIVORS * drawn)


if __name__ == "__main__":
    sys.exit(main())
