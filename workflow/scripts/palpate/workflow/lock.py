"""One run at a time on a folder.

The kernel frees a lock (``flock``) when the process that holds it ends, however it ends: a run that
was killed leaves nothing to be unlocked by hand.
"""

import errno
import fcntl
import os
import platform
from collections.abc import Callable
from pathlib import Path

LOCK = ".run.lock"
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
# Of the locks of this process: closed by its end and by nothing else.
_descriptors: list[int] = []


def lock_folder(folder: str, *, warn: Callable[[str], None]) -> None:
    """Hold a folder until this process ends.

    Parameters
    ----------
    folder : str
    warn : callable
        Takes one line on a file system that has no locks.

    Raises
    ------
    ValueError
        If the folder can't be written to, or another process holds it.
    """
    path = Path(folder) / LOCK
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _descriptors.append(descriptor := os.open(path, os.O_RDWR | os.O_CREAT, 0o666))
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"process {os.getpid()} on {platform.node()}\n".encode(), 0)
    except BlockingIOError:
        holder = path.read_text(encoding="utf-8", errors="replace").strip() or "just begun"
        raise ValueError(f"{folder}: expected no other run at work, found one ({holder})") from None
    except OSError as error:
        if error.errno not in NO_LOCKS:
            reason = (error.strerror or str(error)).lower()
            raise ValueError(f"{folder}: expected a folder to write into, found {reason}") from None
        warn(f"{folder}: this file system has no locks; see that no other run works on it")
