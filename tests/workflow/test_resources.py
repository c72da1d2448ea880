"""Time and memory of a run by rule."""

import os
import subprocess
import sys

import pytest
from palpate.workflow.resources import main, resource_table

HEAD = "s\th:m:s\tmax_rss\tcpu_time\n"


@pytest.fixture
def benchmarks(tmp_path):
    texts = {
        "clouds/a.tsv": "10.0\t0:00:10\t400\t8.0\n",
        "clouds/b.tsv": "30.0\t0:00:30\t300\t20.5\n",
        "lab_capture/a.tsv": "100.0\t0:01:40\t600\t90\n",
        "lab_fidelity.tsv": "5.0\t0:00:05\t200\t4\n",
        "summary.tsv": "0.2\t0:00:00\tNA\t-\n",
    }
    folder = tmp_path / "benchmarks"
    for name, row in texts.items():
        (folder / name).parent.mkdir(exist_ok=True, parents=True)
        (folder / name).write_text(HEAD + row)
    return folder


def test_jobs_are_summed_up_by_rule_and_part(benchmarks):
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


def test_the_page_has_units_and_leaves_unknown_memory_empty(benchmarks, tmp_path):
    main(tmp_path)
    text = (tmp_path / "tables/resources.md").read_text()
    assert "| rule | part | jobs | total_s |" in text
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
