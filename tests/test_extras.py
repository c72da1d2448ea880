"""An installation can do what its extras are for, and says of the rest what it lacks."""

import ast
import json
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, packages_distributions, requires

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

# Packages that are None cannot be imported.
WITHOUT = """
import sys
sys.modules |= dict.fromkeys(sys.argv.pop(1).split(","))
from palpate.__main__ import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def project(root):
    return tomllib.loads((root / "pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def modules():
    """Names that are imported, with the distributions that have them."""
    found = packages_distributions()
    return {name: {*map(canonicalize_name, of)} for name, of in found.items()}


def declared(project, extra):
    """Requirements of the project with an extra, those of the extras that it contains too."""
    lines = [*project["dependencies"], *project["optional-dependencies"].get(extra, ())]
    for one in map(Requirement, lines):
        if one.name == "palpate":
            yield from declared(project, *one.extras)
        else:
            yield one


def installed(requirements):
    """Names of distributions that these bring, directly or not."""
    found, waiting = set(), list(requirements)
    while waiting:
        one = waiting.pop()
        name = canonicalize_name(one.name)
        if name not in found and (one.marker is None or one.marker.evaluate({"extra": ""})):
            found.add(name)
            try:
                waiting += map(Requirement, requires(name) or ())
            except PackageNotFoundError:
                continue
    return found


@pytest.fixture
def palpate(root, tmp_path, project, modules):
    """Run the command with what an extra brings and nothing else."""

    def run(extra, *arguments):
        there = installed(declared(project, extra))
        blocked = [name for name, of in modules.items() if not of & (there | {"palpate"})]
        blocked = ",".join({*blocked} - sys.stdlib_module_names)
        command = [sys.executable, "-c", WITHOUT, blocked, *arguments]
        path = {"PYTHONPATH": str(root / "workflow/scripts"), "OMP_NUM_THREADS": "1"}
        return subprocess.run(command, cwd=tmp_path, env=path, capture_output=True, text=True)

    return run


def test_all_that_is_imported_is_declared(root, project, modules):
    names = installed(declared(project, "all"))
    library = root / "workflow/scripts/palpate"
    # What serves the Snakefile runs where Snakemake is.
    for path in {*library.rglob("*.py")} - {*(library / "workflow").rglob("*.py")}:
        for node in ast.walk(ast.parse(path.read_text())):
            names_of = [one.name for one in node.names] if isinstance(node, ast.Import) else []
            names_of += [node.module] if isinstance(node, ast.ImportFrom) and not node.level else []
            for name in {one.partition(".")[0] for one in names_of} - sys.stdlib_module_names:
                assert name == "palpate" or modules[name] & names, f"{path.name}: {name}"


def test_curves_need_no_extra(palpate, tmp_path):
    depth = np.linspace(-1e-3, 5e-4, 60)
    force = 4 / 3 * 20e3 * np.sqrt(5e-3) * np.maximum(depth, 0) ** 1.5
    force += 1e-4 * np.random.default_rng(1).normal(size=60)
    rows = [f"{d},{f}" for d, f in zip(depth, force, strict=True)]
    (tmp_path / "curve.csv").write_text("\n".join(["depth_m,force_n", *rows]))
    done = palpate("", "hertz", "curve.csv", "--radius-mm", "5", "--json", "--figure", "curve.png")
    assert done.returncode == 0, done.stderr
    low, high = json.loads(done.stdout)["reduced_modulus_interval_pa"]
    assert low < 20e3 < high
    assert (tmp_path / "curve.png").stat().st_size > 10_000


def test_pictures_need_no_mesh(palpate, tmp_path):
    done = palpate(
        "vision", "board", "charuco", "--squares", "7x5", "--square-mm", "30", "--output", "b.pdf"
    )
    assert done.returncode == 0, done.stderr


def test_what_needs_an_extra_names_it(palpate):
    for extra, verb, line in (
        ("", "calibrate", "expected cv2, found none; remedy: install palpate[vision]"),
        ("vision", "direct", "expected open3d, found none; remedy: install palpate[mesh]"),
    ):
        done = palpate(extra, verb, "raw/sponge")
        assert (done.returncode, done.stderr) == (1, f"error: palpate {verb}: {line}\n")
        quietly = palpate(extra, "--quiet", verb, "raw/sponge")
        assert (quietly.returncode, quietly.stderr) == (done.returncode, done.stderr)
        listed = palpate(extra, "--help").stdout
        assert "E* of curves" in listed and "needs palpate[mesh]" in listed
    assert palpate("vision", "export", "--help").returncode == 0
    assert palpate("vision", "exprt").stderr.startswith("error: ")
