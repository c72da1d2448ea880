"""Time and memory of a run by rule, and what the SLURM profile asks for by them."""

import os
import re
import subprocess
import sys

import pytest
import yaml
from palpate.workflow.resources import main, resource_table
from slurm_resources import requests
from thesis.artefacts import ARTEFACTS

HEAD = "s\th:m:s\tmax_rss\tcpu_time\n"


def written(folder, **rows):
    """Benchmarks of rules."""
    for name, row in rows.items():
        path = folder / f"{name.replace('__', '/')}.tsv"
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(f"{HEAD}{row}\n")
    return folder


@pytest.fixture
def benchmarks(tmp_path):
    return written(
        tmp_path / "benchmarks",
        clouds__a="10.0\t0:00:10\t400\t8.0",
        clouds__b="30.0\t0:00:30\t300\t20.5",
        lab_capture__a="100.0\t0:01:40\t600\t90",
        lab_fidelity="5.0\t0:00:05\t200\t4",
        summary="0.2\t0:00:00\tNA\t-",
    )


def test_jobs_are_summed_up_by_rule_and_part(benchmarks, tmp_path):
    table = resource_table(benchmarks)
    assert list(table["rule"]) == [
        *("lab_capture", "clouds", "lab_fidelity", "summary"),
        *("total", "total"),
    ]
    clouds = table[table["rule"] == "clouds"].iloc[0]
    assert tuple(clouds)[1:] == ("pipeline", 2, 40.0, 30.0, 28.5, 400.0)
    lab, pipeline = table[table["rule"] == "total"].itertuples(index=False)
    assert (lab.part, lab.jobs, lab.total_s, lab.peak_memory_mb) == ("lab", 1, 100.0, 600.0)
    assert (pipeline.part, pipeline.jobs, pipeline.total_s) == ("pipeline", 4, 45.2)
    main(tmp_path)
    text = (tmp_path / "tables/resources.md").read_text()
    assert "| summary | pipeline | 1 | 0 | 0 | 0 |  |" in text


def test_bad_benchmarks_are_refused(tmp_path):
    with pytest.raises(ValueError, match="expected benchmarks of a run, found none"):
        resource_table(tmp_path)
    (tmp_path / "clouds.tsv").write_text("s\tmax_rss\n1\t2\n")
    with pytest.raises(ValueError, match=r"clouds\.tsv: cpu_time: expected a column, found none"):
        resource_table(tmp_path)


def test_a_run_that_left_nothing_ends_in_one_line(root, tmp_path):
    command = [sys.executable, "-m", "palpate.workflow.resources", tmp_path]
    library = os.environ | {"PYTHONPATH": str(root / "workflow/scripts")}
    done = subprocess.run(command, capture_output=True, text=True, env=library, check=False)
    assert done.returncode == 1
    line = f"error: resources: {tmp_path}/benchmarks: expected benchmarks of a run, found none\n"
    assert done.stderr == line
    assert not (tmp_path / "tables").exists()


def test_the_largest_job_with_a_margin_and_twice_as_much_at_each_retry(tmp_path):
    rows = {"track__a": "59\t0:00:59\t700.0\t20", "track__b": "61\t0:01:01\t301.0\t20"}
    benchmarks = written(tmp_path, **rows, summary="0.4\t0:00:00\tNA\tNA")
    asked = yaml.safe_load(requests(benchmarks))["set-resources"]
    found = {
        rule: [tuple(eval(text, {"attempt": n}) for text in of.values()) for n in (1, 2)]
        for rule, of in asked.items()
    }
    # 1.5 x 700 + 400 MB, in steps of 100; twice 61 s and the time to read the workflow.
    assert found == {"summary": [(400, 3), (800, 6)], "track": [(1500, 5), (3000, 10)]}


def test_names_of_the_profile_are_rules(root):
    profile = yaml.safe_load((root / "workflow/profiles/slurm/config.yaml").read_text())
    text = "".join(path.read_text() for path in (root / "workflow").rglob("*.smk"))
    rules = set(re.findall(r"^ *(?:rule|use rule \w+ as) (\w+)", text, re.MULTILINE))
    rules |= {entry.name for entry in ARTEFACTS}
    assert set(profile["groups"]) <= rules
    assert set(profile["group-components"]) <= set(profile["groups"].values())
    assert {"track", "indentation", "direct"} <= set(profile["set-resources"])
