"""SLURM on this one machine, under a folder of its own: real daemons, no accounting."""

import ctypes
import getpass
import os
import shutil
import signal
import socket
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

NEEDED = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "sinfo", "scontrol")
# Daemons stand there, and not every user's PATH has it.
PATH = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/sbin"])
CORES = 2
SECONDS = 60
PR_SET_PDEATHSIG = 1
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
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory_mb} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def missing():
    """What this machine lacks, by name; nothing where SLURM is required."""
    if "slurm" in os.environ.get("PALPATE_TESTS_REQUIRE", ""):
        return []
    return [name for name in NEEDED if shutil.which(name, path=PATH) is None]


def free_ports(count):
    """Ports that nobody listens at; taken together, so that no two are the same."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()


def write_configuration(folder, *, cores=CORES, memory_mb=6000):
    """Write slurm.conf and the key of munge; the configuration's path."""
    for name in ("state", "spool"):
        (folder / name).mkdir()
    (folder / "munge.key").write_bytes(os.urandom(128))
    (folder / "munge.key").chmod(0o600)
    path = folder / "slurm.conf"
    path.write_text(
        CONFIGURATION.format(
            host=socket.gethostname().split(".")[0],
            user=getpass.getuser(),
            ports=free_ports(2),
            folder=folder,
            cores=cores,
            memory_mb=memory_mb,
        )
    )
    return path


@contextmanager
def slurm(folder, **sizes):
    """Run SLURM while the block lasts; the environment in which its commands find it."""
    folder = Path(folder)
    folder.chmod(0o755)
    path = write_configuration(folder, **sizes)
    env = os.environ | {"SLURM_CONF": str(path), "PATH": _own_srun(folder, path)}
    daemons = []
    try:
        daemons.append(_start(folder, env, "munged", *_munge_options(folder)))
        _wait(lambda: (folder / "munge.socket").exists(), folder, "munged")
        daemons.append(_start(folder, env, "slurmctld", "-D", "-c", "-f", str(path)))
        daemons.append(_start(folder, env, "slurmd", "-D", "-c", "-f", str(path)))
        _wait(lambda: "idle" in _sinfo(env), folder, "slurmd")
        yield env
    finally:
        subprocess.run(["scancel", "--user", getpass.getuser()], env=env, check=False)
        for daemon in reversed(daemons):
            _stop(daemon)


def _own_srun(folder, configuration):
    """A PATH whose srun knows where SLURM is: Snakemake clears SLURM_CONF within a job."""
    place = folder / "bin"
    place.mkdir()
    real = shutil.which("srun", path=PATH)
    (place / "srun").write_text(f'#!/bin/sh\nSLURM_CONF={configuration} exec {real} "$@"\n')
    (place / "srun").chmod(0o755)
    return os.pathsep.join([str(place), PATH])


def _munge_options(folder):
    files = {"socket": "munge.socket", "key-file": "munge.key", "pid-file": "munge.pid"}
    files |= {"log-file": "munge.log", "seed-file": "munge.seed"}
    return ["--foreground", "--force", *(f"--{key}={folder / name}" for key, name in files.items())]


def _start(folder, env, *command):
    with (folder / f"{command[0]}.out").open("w") as stream:
        return subprocess.Popen(
            command,
            env=env,
            stdout=stream,
            stderr=stream,
            start_new_session=True,
            preexec_fn=_end_with_the_tests,
        )


def _end_with_the_tests():
    """A test run that is killed cannot stop its daemons: the kernel does."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def _sinfo(env):
    done = subprocess.run(
        ["sinfo", "--noheader", "--format=%t"], env=env, capture_output=True, text=True, check=False
    )
    return done.stdout


def _wait(ready, folder, name):
    """Wait for a daemon; what it wrote says why when it does not come."""
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        if ready():
            return
        time.sleep(0.2)
    logs = [folder / f"{name}.out", folder / f"{name}.log"]
    text = "\n".join(path.read_text() for path in logs if path.is_file())
    raise TimeoutError(f"{name}: expected it within {SECONDS} s, found nothing\n{text[-3000:]}")


def _stop(daemon):
    daemon.send_signal(signal.SIGTERM)
    try:
        daemon.wait(10)
    except subprocess.TimeoutExpired:
        daemon.kill()
        daemon.wait()
