"""The workflow through SLURM's real daemons on this machine, with the bytes of a plain run."""

import ctypes
import getpass
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager

import pytest
from sample_run import SAMPLE, ran

NEEDED = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "sinfo", "scontrol")
# Daemons stand there, and not every user's PATH has it.
PATH = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/sbin"])
# What this machine lacks; nothing where SLURM is required.
REQUIRED = "slurm" in os.environ.get("PALPATE_TESTS_REQUIRE", "")
MISSING = [name for name in NEEDED if not (REQUIRED or shutil.which(name, path=PATH))]
pytestmark = [
    pytest.mark.long,
    pytest.mark.workflow,
    pytest.mark.skipif(
        bool(MISSING),
        reason=f"no SLURM here: {', '.join(MISSING)} (Debian: apt-get install slurm-wlm munge)",
    ),
]
SECONDS = 60
PR_SET_PDEATHSIG = 1
# No accounting.
CONFIGURATION = """\
ClusterName=palpate
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CryptoType=crypto/munge
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
MpiDefault=none
ReturnToService=2
MinJobAge=300
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=6000 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
# The whole sample, submitted job by job, takes more than four minutes of processor time: this is
# the part up to the clouds of one capture, five jobs in three entries of the queue.
KINECT = "results/sample/foam_block/kinect"
TARGET = f"{KINECT}/08/clouds.npz"
COMPARED = ("background.npz", "support_plane.json")
COMPARED += ("08/mask.npz", "08/probe_pose.csv", "08/clouds.npz")


def free_ports(count):
    """Ports that nobody listens at; taken together, so that no two are the same."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


def end_with_the_tests():
    """A test run that is killed cannot stop its daemons: the kernel does."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


@contextmanager
def daemon(folder, env, ready, *command):
    """Run a daemon while the block lasts; what it wrote says why when it does not come."""
    name, how = command[0], {"start_new_session": True, "preexec_fn": end_with_the_tests}
    with (folder / f"{name}.out").open("w") as out:
        process = subprocess.Popen(command, env=env, stdout=out, stderr=out, **how)
        try:
            end = time.monotonic() + SECONDS
            while not ready():
                if time.monotonic() > end:
                    text = "\n".join(path.read_text() for path in folder.glob(f"{name}.[lo]*"))
                    raise TimeoutError(f"{name}: expected within {SECONDS} s\n{text[-3000:]}")
                time.sleep(0.2)
            yield
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def own_srun(folder, configuration):
    """A PATH whose srun knows where SLURM is: Snakemake clears SLURM_CONF within a job."""
    place = folder / "bin/srun"
    place.parent.mkdir()
    real = shutil.which("srun", path=PATH)
    place.write_text(f'#!/bin/sh\nSLURM_CONF={configuration} exec {real} "$@"\n')
    place.chmod(0o755)
    return os.pathsep.join([str(place.parent), PATH])


@pytest.fixture
def cluster(tmp_path):
    """SLURM on this one machine: the environment in which its commands find it."""
    folder, user = tmp_path / "slurm", getpass.getuser()
    for name in ("", "state", "spool"):
        (folder / name).mkdir()
    folder.chmod(0o755)
    (folder / "munge.key").write_bytes(os.urandom(128))
    (folder / "munge.key").chmod(0o600)
    path, known = folder / "slurm.conf", {"folder": folder, "user": user, "ports": free_ports(2)}
    path.write_text(CONFIGURATION.format(host=socket.gethostname().split(".")[0], **known))
    env = os.environ | {"SLURM_CONF": str(path), "PATH": own_srun(folder, path)}
    munge = {"socket": "munge.socket", "key-file": "munge.key", "pid-file": "munge.pid"}
    munge |= {"log-file": "munged.log", "seed-file": "munge.seed"}
    munge = [f"--{name}={folder / file}" for name, file in munge.items()]
    idle = ["sinfo", "--noheader", "--format=%t"]
    given = ("-D", "-c", "-f", str(path))
    with ExitStack() as stack:

        def start(ready, *command):
            stack.enter_context(daemon(folder, env, ready, *command))

        start((folder / "munge.socket").exists, "munged", "--foreground", "--force", *munge)
        start(lambda: True, "slurmctld", *given)
        start(lambda: b"idle" in subprocess.run(idle, env=env, stdout=-1).stdout, "slurmd", *given)
        stack.callback(subprocess.run, ["scancel", "--user", user], env=env)
        yield env | {"PYTHONDONTWRITEBYTECODE": "1"}


def on_slurm(folder, env, *arguments):
    """Run Snakemake with the SLURM profile, as a user would; no accounting, so squeue tells."""
    command = [sys.executable, "-m", "snakemake", "--profile", "none"]
    command += ["--workflow-profile", "workflow/profiles/slurm", "--retries", "0"]
    command += ["--slurm-status-command", "squeue", "--slurm-no-account", "--latency-wait", "30"]
    command += ["--slurm-init-seconds-before-status-checks", "3", *arguments]
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=False)


def test_a_chain_gives_the_bytes_of_a_plain_run(fresh, cluster):
    ran(fresh, *SAMPLE, "--", TARGET)
    plain = fresh / "plain"
    (fresh / KINECT).rename(plain)
    shutil.rmtree(fresh / ".snakemake")
    done = on_slurm(fresh, cluster, *SAMPLE, "--", TARGET)
    told = done.stdout + done.stderr
    assert done.returncode == 0, told[-5000:]
    # Entries of the queue.
    assert told.count("has been submitted with SLURM jobid") == 3
    for name in COMPARED:
        assert (fresh / KINECT / name).read_bytes() == (plain / name).read_bytes(), name
