"""One run at a time on a folder of results, and what that run found when it began.

The kernel frees a lock (``flock``) when the process that holds it ends, however it ends: a run that
was killed leaves nothing to be unlocked by hand.
"""

import errno
import fcntl
import json
import os
import platform
import secrets
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from palpate.capture.files import remove_parts, whole_file
from palpate.capture.fingerprint import stamp

LOCK = ".run.lock"
BEGUN = ".run.json"
# What jobs find in their environment: see workflow/scripts/job_run.py.
INPUTS = "PALPATE_RUN_INPUTS"
RUN = "PALPATE_RUN_ID"
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
LONGEST_HOLDER = 200
# Of the locks of this process: closed by its end and by nothing else.
_descriptors: list[int] = []


def begin_run(
    jobs: Iterable,
    running: Iterable,
    *,
    results: str,
    raw: str,
    seen: Mapping[str, str],
    warn: Callable[[str], None],
) -> None:
    """Lock what a run writes into, remove what killed jobs left there, and write down its inputs.

    Parameters
    ----------
    jobs, running : iterable of Snakemake's jobs
        All of the run, and those of them that are still to be done.
    results, raw : str
        Folders of the run; ``raw`` is locked if the lab writes into it.
    seen : mapping
        Stamps of dropped inputs by path, from before they were checked.
    warn : callable
        Is told, in one line, of a file system that has no locks.

    Raises
    ------
    ValueError
        If a folder can't be written to, or another run works on it.
    """
    running = list(running)
    made = {path for job in jobs for path in _made_by(job)}
    used = {str(path) for job in running for path in job.input} - made
    written = {str(path) for job in running for path in job.output}
    made_raw = {Path(path).relative_to(raw).parts[0] for path in written if _below(path, raw)}
    for folder in [results, *([raw] if made_raw else [])]:
        lock_folder(folder, warn=warn)
    # What people import into other folders of raw/ at this time is theirs.
    for folder in [results, *(Path(raw) / name for name in sorted(made_raw))]:
        remove_parts(folder, unless=LOCK)
    inputs = {path: seen.get(str(Path(path))) or stamp(path) for path in sorted(used)}
    begun = Path(results) / BEGUN
    run = secrets.token_hex(8)
    with whole_file(begun) as part:
        text = json.dumps({"run": run, "inputs": inputs}, indent=1)
        part.write_text(text + "\n", encoding="utf-8")
    os.environ |= {INPUTS: str(begun), RUN: run}


def _made_by(job: object) -> set[str]:
    """Every file that a job writes: rules read each other's benchmarks and logs too."""
    benchmark = [job.benchmark] if job.benchmark else []
    return {str(path) for path in (*job.output, *job.log, *benchmark)}


def lock_folder(folder: str | Path, *, warn: Callable[[str], None]) -> None:
    """Hold a folder until this process ends; see `begin_run` for the parameters.

    Raises
    ------
    ValueError
        If the folder can't be written to, or another process holds it.
    """
    path = Path(folder) / LOCK
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        _lock(descriptor, folder, warn)
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"process {os.getpid()} on {platform.node()}\n".encode())
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise ValueError(f"{folder}: expected a folder to write into, found {reason}") from error
    _descriptors.append(descriptor)


def _lock(descriptor: int, folder: str | Path, warn: Callable[[str], None]) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = os.read(descriptor, LONGEST_HOLDER).decode(errors="replace").strip()
        os.close(descriptor)
        raise ValueError(
            f"{folder}: expected no other run at work, found one ({holder or 'just begun'})"
        ) from None
    except OSError as error:
        if error.errno not in NO_LOCKS:
            raise
        warn(f"{folder}: this file system has no locks; see that no other run works on it")


def _below(path: str, folder: str) -> bool:
    return Path(folder) in Path(path).parents
