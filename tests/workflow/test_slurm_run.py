"""The workflow through SLURM's real daemons on this machine, with the bytes of a plain run."""

import re
import shutil
import subprocess
import sys

import pytest
from sample_run import LEFT_BEHIND, SAMPLE, snakemake
from slurm_machine import missing, slurm

pytestmark = [
    pytest.mark.long,
    pytest.mark.workflow,
    pytest.mark.skipif(
        bool(missing()),
        reason=f"no SLURM here: {', '.join(missing())} (Debian: apt-get install slurm-wlm munge)",
    ),
]
# The whole sample, submitted job by job, takes more than four minutes of processor time: this is
# the part up to the clouds of one capture, five jobs in three entries of the queue.
KINECT = "results/sample/foam_block/kinect"
TARGET = f"{KINECT}/08/clouds.npz"
COMPARED = ("background.npz", "support_plane.json")
COMPARED += ("08/mask.npz", "08/probe_pose.csv", "08/clouds.npz")


@pytest.fixture
def cluster(tmp_path):
    folder = tmp_path / "slurm"
    folder.mkdir()
    with slurm(folder) as env:
        yield env | {"PYTHONDONTWRITEBYTECODE": "1"}


def on_slurm(folder, env, *arguments):
    """Run Snakemake with the SLURM profile, as a user would; no accounting, so squeue tells."""
    command = [sys.executable, "-m", "snakemake", "--profile", "none"]
    command += ["--workflow-profile", "workflow/profiles/slurm", "--retries", "0"]
    command += ["--slurm-status-command", "squeue", "--slurm-no-account", "--latency-wait", "30"]
    command += ["--slurm-init-seconds-before-status-checks", "3"]
    return subprocess.run(
        [*command, *arguments], cwd=folder, env=env, capture_output=True, text=True, check=False
    )


def submitted(done):
    """Entries of the queue that a run made."""
    return len(re.findall(r"has been submitted with SLURM jobid", done.stdout + done.stderr))


@pytest.fixture
def fresh(root, tmp_path):
    """A copy of the project in which nothing ran yet."""
    folder = tmp_path / "main"
    shutil.copytree(root, folder, ignore=LEFT_BEHIND)
    shutil.copytree(root / "tests/sample/raw", folder / "tests/sample/raw", dirs_exist_ok=True)
    return folder


def test_a_chain_gives_the_bytes_of_a_plain_run(fresh, cluster):
    done = snakemake(fresh, *SAMPLE, "--", TARGET)
    assert done.returncode == 0, done.stderr[-3000:]
    plain = fresh / "plain"
    (fresh / KINECT).rename(plain)
    shutil.rmtree(fresh / ".snakemake")
    done = on_slurm(fresh, cluster, *SAMPLE, "--", TARGET)
    assert done.returncode == 0, (done.stdout + done.stderr)[-5000:]
    assert submitted(done) == 3
    for name in COMPARED:
        assert (fresh / KINECT / name).read_bytes() == (plain / name).read_bytes(), name
