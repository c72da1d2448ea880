"""The digest follows a script's local imports and the versions of packages, and nothing else."""

import json
import subprocess
import sys

import pytest
from palpate.run import digest
from palpate.run.digest import code, imported_modules, whole_code

# Of a Snakefile's rules with a script, without running anything: the params that Snakemake keeps,
# and which blocks of options are among them.
RULES = """
import json, sys
from pathlib import Path
from types import SimpleNamespace
from snakemake.api import SnakemakeApi
from snakemake.settings.types import ConfigSettings, OutputSettings, ResourceSettings

file, config = Path(sys.argv[1]), json.loads(sys.argv[2])
with SnakemakeApi(OutputSettings()) as api:
    flow = api.workflow(
        ResourceSettings(cores=1), config_settings=ConfigSettings(config=config), snakefile=file
    )
    rules = [rule for rule in flow._workflow.rules if rule.script]
    run = flow._workflow.globals["RUN"]
    run = getattr(run, "run", run)
    of = {"object": "foam_block", "sensor": "kinect", "capture": "08", "tracker": run.tracker}
    found = {}
    for rule in rules:
        params = {name: getattr(rule.params, name) for name in rule.params.keys()}
        asks = [name for name, value in params.items() if callable(value)]
        for name in filter(lambda name: rule._is_deriving_function(params[name]), asks):
            del params[name]
        options = params.get("options", {})
        options = options(SimpleNamespace(**of)) if callable(options) else options
        found[rule.name] = [list(params), []]
        for block in sys.argv[3:]:
            there = run.config
            for part in block.split("."):
                there = there[part]
            plain = {name: there[name] for name in there.keys() - {"objects", "steps"}}
            if isinstance(options, dict) and plain.items() <= options.items():
                found[rule.name][1].append(block)
    print(json.dumps(found))
"""
# The stages that compute with each block of options.
STAGES = {
    "background": {"background_model", "mask"},
    "support_plane": {"support_plane"},
    "probe_pose": {"probe_pose"},
    "force": {"force"},
    "clouds": {"clouds", "rest_cloud"},
    "tracking.alignment": {"align"},
    "tracking.trackers.study": {"track"},
    "hertz": {"hertz"},
    "minimise": {"minimise"},
    "direct.model": {"indentation"},
    "direct.observation": {"surface_motion"},
    "direct.fit": {"direct", "direct_object", "curve"},
}
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


def rules_of(root, file, paths, *blocks):
    command = [sys.executable, "-c", RULES, file, json.dumps({"paths": paths}), *blocks]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


@pytest.mark.workflow
def test_every_rule_depends_on_its_code_its_folders_and_its_options(root):
    """By params that Snakemake keeps, which are none that ask for a job's input."""
    rules = rules_of(root, "workflow/Snakefile", {"raw": "results/none"}, *STAGES)
    assert len(rules) >= 90
    assert [name for name, (kept, _) in rules.items() if not {"code", "content"} <= set(kept)] == []
    for block, stages in STAGES.items():
        assert {name for name, (_, blocks) in rules.items() if block in blocks} >= stages


@pytest.mark.workflow
def test_every_rule_of_objects_by_themselves_depends_on_its_code_and_folders(root):
    raw = {"raw": "tests/sample/raw", "sensors": "tests/sample/sensors"}
    rules = rules_of(root, "workflow/objects.smk", raw)
    assert len(rules) >= 4
    assert [name for name, (kept, _) in rules.items() if not {"code", "content"} <= set(kept)] == []
