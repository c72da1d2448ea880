"""What the tests that run scripts, or Snakemake itself, share."""

import fcntl
import shutil

import pytest
from sample_run import SAMPLE, copied, ran


@pytest.fixture(scope="session")
def sample(root, tmp_path_factory, worker_id):
    """A copy of the project in which the sample ran, for all workers: not to be changed."""
    shared = tmp_path_factory.getbasetemp()
    shared = (shared if worker_id == "master" else shared.parent) / "sample"
    with (shared.parent / "sample.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (shared / "results/sample/summary.csv").is_file():
            ran(copied(root, shared), *SAMPLE)
    return shared


@pytest.fixture(scope="session")
def copy(sample, tmp_path_factory):
    """The same, to be changed."""
    return shutil.copytree(sample, tmp_path_factory.mktemp("palpate") / "main")


@pytest.fixture
def fresh(root, tmp_path):
    """A copy of the project in which nothing ran yet, to be changed."""
    return copied(root, tmp_path / "main")
