"""What the tests that run scripts, or Snakemake itself, share."""

import logging
import shutil

import pytest
from sample_run import LEFT_BEHIND, SAMPLE, snakemake


@pytest.fixture(scope="session")
def copy(root, tmp_path_factory):
    """A copy of the project in which the sample ran once."""
    folder = tmp_path_factory.mktemp("palpate") / "main"
    shutil.copytree(root, folder, ignore=LEFT_BEHIND)
    shutil.copytree(root / "tests/sample/raw", folder / "tests/sample/raw", dirs_exist_ok=True)
    done = snakemake(folder, *SAMPLE)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


@pytest.fixture(autouse=True)
def handlers():
    """Scripts take the root logger over; its handlers' streams are closed afterwards."""
    logger = logging.getLogger()
    kept, level = logger.handlers[:], logger.level
    yield
    logger.handlers[:] = kept
    logger.setLevel(level)
