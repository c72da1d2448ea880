"""What the SLURM profile asks for follows from a run's benchmarks."""

import re

import pytest
import yaml
from slurm_resources import requests
from thesis.artefacts import ARTEFACTS

HEADER = "s\th:m:s\tmax_rss\tcpu_time\n"


@pytest.fixture
def benchmarks(tmp_path):
    for name, row in {
        "track/a.tsv": "59\t0:00:59\t700.0\t20",
        "track/b.tsv": "61\t0:01:01\t301.0\t20",
        "summary.tsv": "0.4\t0:00:00\tNA\tNA",
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(HEADER + row + "\n")
    return tmp_path


def test_the_largest_job_with_a_margin_and_twice_as_much_at_each_retry(benchmarks):
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
