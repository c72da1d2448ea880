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
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

from palpate.capture.files import remove_parts, whole_file
from palpate.capture.fingerprint import stamp

LOCK = ".run.lock"
BEGUN = ".run.json"
# What jobs find in their environment: see workflow/scripts/job_run.py.
INPUTS = "PALPATE_RUN_INPUTS"
RUN = "PALPATE_RUN_ID"
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
LONGEST_HOLDER = 200
# A run that is read holds a folder for a moment, to see whether another does.
ATTEMPTS, PAUSE_S = 3, 0.1
# Of the locks of this process: closed by its end and by nothing else.
_descriptors: list[int] = []


def begin_run(
    jobs: Iterable,
    running: Iterable,
    *,
    results: str,
    raw: str,
    seen: Mapping[str, str],
    last: Mapping[str, str | None],
    shared: Iterable[str] = (),
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
    last : mapping
        Of `last_holders`, from before the run was planned.
    shared : iterable of str, optional
        Folders above, which others may hold as well that write elsewhere below them.
    warn : callable
        Is told, in one line, of a file system that has no locks.

    Raises
    ------
    ValueError
        If a folder can't be written to, or another run works on it, or has since the plan was made.
    """
    running = list(running)
    made = {path for job in jobs for path in _made_by(job)}
    used = {str(path) for job in running for path in job.input} - made
    written = {str(path) for job in running for path in job.output}
    made_raw = {Path(path).relative_to(raw).parts[0] for path in written if _below(path, raw)}
    for folder in [results, *([raw] if made_raw else [])]:
        lock_folder(folder, last=last, warn=warn)
    for folder in shared:
        lock_folder(folder, shared=True, warn=warn)
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


def last_holders(*folders: str) -> dict[str, str | None]:
    """Who held folders last, by folder; None where somebody does."""
    return {folder: _last_holder(Path(folder) / LOCK) for folder in folders}


def _last_holder(path: Path) -> str | None:
    try:
        with path.open(encoding="utf-8", errors="replace") as stream:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
            return stream.read(LONGEST_HOLDER).strip()
    except BlockingIOError:
        return None
    except OSError:  # nobody was there, or no locks are
        return ""


def lock_folder(
    folder: str | Path,
    *,
    last: Mapping[str, str | None] = MappingProxyType({}),
    shared: bool = False,
    warn: Callable[[str], None],
) -> None:
    """Hold a folder until this process ends; see `begin_run` for the parameters.

    Raises
    ------
    ValueError
        If the folder can't be written to, another process holds it, or another than the last has.
    """
    path = Path(folder) / LOCK
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        locked = _lock(descriptor, folder, fcntl.LOCK_SH if shared else fcntl.LOCK_EX, warn)
        if locked and last.get(str(folder), found := _holder(descriptor)) != found:
            os.close(descriptor)
            raise ValueError(
                f"{folder}: expected no other run at work since this one was planned,"
                f" found one ({found}); run again"
            )
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"process {os.getpid()} on {platform.node()}\n".encode(), 0)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise ValueError(f"{folder}: expected a folder to write into, found {reason}") from error
    _descriptors.append(descriptor)


def _lock(descriptor: int, folder: str | Path, kind: int, warn: Callable[[str], None]) -> bool:
    """Whether the file system has locks."""
    for attempt in range(ATTEMPTS):
        try:
            fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            time.sleep(PAUSE_S * (attempt < ATTEMPTS - 1))
        except OSError as error:
            if error.errno not in NO_LOCKS:
                raise
            warn(f"{folder}: this file system has no locks; see that no other run works on it")
            return False
    found = _holder(descriptor) or "just begun"
    os.close(descriptor)
    raise ValueError(f"{folder}: expected no other run at work, found one ({found})")


def _holder(descriptor: int) -> str:
    return os.pread(descriptor, LONGEST_HOLDER, 0).decode(errors="replace").strip()


def _below(path: str, folder: str) -> bool:
    return Path(folder) in Path(path).parents
