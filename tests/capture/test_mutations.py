"""Some of the mutations of ``make mutations``: each ends with a clear line or a right result.

They run in a process of their own: a judge forks, which one that has started threads must not.
"""

import csv
import re
import subprocess
import sys

import pytest
from spoilt.corpus import corpus, drawn

KINDS = ("picture", "background", "table", "YAML", "name", "template", "field")
COUNT, SEED = 60, 20
# Numbers that a schema takes and only the jobs can refuse.
DEEP = {
    "physics: wrench in mN and mNm": "at most 500 N from a hand",
    "physics: sign flipped": "along the probe, found it 17",
    "physics: torque in mNm": "of the sphere's centre",
}
MATCH = f"^({'|'.join(KINDS)}): "
MUTATIONS = [one.key for one in corpus()]
SHALLOW = drawn([key for key in MUTATIONS if re.search(MATCH, key)], COUNT, seed=SEED)


@pytest.fixture(scope="module")
def judged(root, tmp_path_factory):
    """Runs ``tests/mutations.py``; gives the rows of its table."""

    def run(*options):
        table = tmp_path_factory.mktemp("mutations") / "mutations.csv"
        command = [sys.executable, root / "tests/mutations.py", table, *options]
        done = subprocess.run(command, capture_output=True, text=True, timeout=1200)
        # 1 says that a verdict is bad, which each test tells of its own mutation.
        assert done.returncode in (0, 1), done.stderr
        with table.open(encoding="utf-8", newline="") as stream:
            return {row["mutation"]: row for row in csv.DictReader(stream)}, done.stderr

    return run


@pytest.fixture(scope="module")
def shallow(judged):
    return judged("--check", "--match", MATCH, "--count", str(COUNT), "--seed", str(SEED))


@pytest.fixture(scope="module")
def deep(judged):
    return judged("--match", f"^({'|'.join(map(re.escape, DEEP))})$")


def test_there_are_many_and_the_same_are_drawn_again():
    assert len(set(MUTATIONS)) == len(MUTATIONS) > 1000
    assert drawn(MUTATIONS, 5, seed=3) == drawn(MUTATIONS, 5, seed=3)


@pytest.mark.parametrize("key", SHALLOW, ids=lambda key: ascii(key)[:60])
def test_the_check_says_it_or_lets_it_pass(key, shallow):
    rows, told = shallow
    assert rows[key]["outcome"] in ("passes the check", "refused by the check"), told


@pytest.mark.parametrize("key", DEEP)
def test_a_plausible_wrong_number_is_refused_by_its_job(key, deep):
    rows, told = deep
    assert rows[key]["outcome"] == "refused by a job", told
    assert DEEP[key] in rows[key]["line"]
