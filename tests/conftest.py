"""What the tests share."""

import logging
from pathlib import Path

import pytest
import yaml
from stage_runs import stage_runner

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def root():
    return ROOT


@pytest.fixture(scope="session")
def sensors():
    return {
        path.stem: yaml.safe_load(path.read_text()) for path in ROOT.glob("config/sensors/*.yaml")
    }


@pytest.fixture(scope="session")
def probe():
    return yaml.safe_load((ROOT / "config/probes/nano25_sphere.yaml").read_text())


@pytest.fixture
def stage(tmp_path, capfd):
    """Run a stage's script; scripts take the root logger over, whose streams are closed after."""
    logger = logging.getLogger()
    kept, level = logger.handlers[:], logger.level
    yield stage_runner(tmp_path, capfd)
    logger.handlers[:] = kept
    logger.setLevel(level)


@pytest.fixture(scope="session")
def synthetic(probe):
    """A capture of which everything is known."""
    from synthetic_capture import synthetic_capture

    return synthetic_capture(probe)


@pytest.fixture(scope="session")
def more_real_data():
    """Too large to be committed, or not to be passed on; tests/real is in every clone."""
    folder = ROOT.parent / "shared" / "real"
    if not folder.is_dir():
        pytest.skip(f"more real data is not beside the project ({folder})")
    return folder
