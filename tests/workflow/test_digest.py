"""The digest follows the packages that a script imports and the pinned versions."""

import json
import subprocess
import sys

import pytest
from palpate.workflow import digest
from palpate.workflow.digest import code

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
        beside = {"conda": rule.conda_env, "more": sorted(params.get("more", ()))}
        found[rule.name] = [list(params), [], beside]
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
    files = {
        "palpate/__init__.py": "",
        "palpate/units.py": "",
        "palpate/solid/mesh.py": "import numpy\n",
        "palpate/solid/load.py": "from palpate.solid.mesh import x\n",
        "palpate/solid/data.csv": "",
        "palpate/surface/track.py": "from palpate.solid.load import z\n",
        "palpate/vision/camera.py": "from palpate import (\n    units,\n)\n",
        "palpate/vision/depth.py": "from palpate.vision import camera\n",
        "palpate/report/style.css": "",
        "palpate/report/figure.py": "",
        "palpate/workflow/job.py": "from palpate.workflow import object_inputs, run\n",
        "palpate/workflow/object_inputs.py": "from palpate.config import model\n",
        "palpate/config/model.py": "",
        "palpate/config/probe.py": "",
        "palpate/workflow/run.py": "",
        "palpate/workflow/start.py": "",
        "virtual_lab/render.py": "from palpate.vision.camera import Camera\n",
        "thesis/chapter5/table.py": "from palpate.report.figure import draw\n",
        "stages/track.py": "from palpate.surface import track\nimport palpate.workflow.job\n",
        "stages/artefact.py": "",
        "lab/render.py": "from virtual_lab.render import render\n",
        "../../environment.lock": LOCK,
    }
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root


JOBS = {"track": ("stages/track.py",), "lab": ("lab/render.py",)}
JOBS["table"] = ("stages/artefact.py", "thesis.chapter5.table:make")


def digests(root):
    # Code is read once a process: a new run of the workflow reads it anew.
    digest._read.cache_clear()
    return {name: code(root / script, *make, root=root) for name, (script, *make) in JOBS.items()}


@pytest.mark.parametrize(
    ("edited", "jobs"),
    [
        ("palpate/surface/track.py", {"track"}),
        # What an imported package imports or ships, and what only lies beside.
        ("palpate/solid/mesh.py", {"track"}),
        ("palpate/solid/data.csv", {"track"}),
        ("palpate/solid/new.py", {"track"}),
        ("palpate/report/style.css", {"table"}),
        ("thesis/chapter5/table.py", {"table"}),
        ("virtual_lab/render.py", {"lab"}),
        ("palpate/vision/camera.py", {"lab"}),
        ("palpate/units.py", {"lab"}),
        ("palpate/vision/depth.py", set()),
        # Of the service, the modules that a job imports.
        ("palpate/workflow/job.py", {"track"}),
        ("palpate/workflow/object_inputs.py", {"track"}),
        ("palpate/workflow/start.py", set()),
        ("palpate/config/model.py", {"track"}),
        ("palpate/config/probe.py", set()),
        ("palpate/workflow/run.py", set()),
    ],
)
def test_an_edit_changes_what_computes_with_it(tree, edited, jobs):
    before = digests(tree)
    with (tree / edited).open("a") as stream:
        stream.write("# edited\n")
    after = digests(tree)
    assert {name for name in JOBS if after[name] != before[name]} == jobs


@pytest.mark.parametrize(
    ("before", "after", "changes"),
    [("1.26.4", "1.26.5", True), ("# via scipy", "# via pandas", False), (":00", ":01", False)],
)
def test_a_version_counts_and_a_comment_does_not(tree, before, after, changes):
    first = digests(tree)
    lock = tree.parents[1] / "environment.lock"
    lock.write_text(lock.read_text().replace(before, after))
    assert (digests(tree) != first) is changes


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
    assert all({"code", "content"} <= set(kept) for kept, *_ in rules.values())
    for block, stages in STAGES.items():
        assert {name for name, (_, blocks, _) in rules.items() if block in blocks} >= stages
    (conda,) = {beside["conda"] for *_, beside in rules.values()}
    assert (root / "workflow/rules" / conda).is_file()
    # What is drawn by chance changes no calibration of the tip.
    assert "seed" not in rules["tip"][2]["more"]
