"""Stamps of what people drop in, so that a changed image re-runs what uses it, and is noticed."""

import hashlib
from pathlib import Path

from palpate.capture.discover import NOT_SENSORS


def folder_fingerprint(folder: str | Path) -> str:
    """Digest the names, sizes and modification times of a folder's files.

    Reading the images themselves at every start would take minutes for a large study; size and
    time change with every ordinary way of replacing a file.

    Parameters
    ----------
    folder : path
        Folder of a capture; hidden files are passed over.

    Returns
    -------
    str
        Sixteen hexadecimal digits.
    """
    folder = Path(folder)
    files = sorted(path for path in folder.rglob("*") if _counts(path, folder))
    digest = hashlib.sha256()
    for path in files:
        status = path.stat()
        entry = f"{path.relative_to(folder)} {status.st_size} {status.st_mtime_ns}\n"
        digest.update(entry.encode())
    return digest.hexdigest()[:16]


def stamp(path: str | Path) -> str:
    """Tell one state of a file or folder from another.

    Returns
    -------
    str
        Fingerprint of a folder; size [bytes], time of modification [ns] and inode of a file; empty
        where nothing stands.
    """
    path = Path(path)
    if path.is_dir():
        return folder_fingerprint(path)
    try:
        status = path.stat()
    except FileNotFoundError:
        return ""
    return f"{status.st_size} {status.st_mtime_ns} {status.st_ino}"


def stamps_below(raw: str | Path) -> dict[str, str]:
    """Stamp whatever may stand in ``raw/`` for a rule to read, by path.

    Parameters
    ----------
    raw : path
        Its objects' files, scans, backgrounds and captures, and experiments on sensors.
    """
    raw = Path(raw)
    files = (path for path in raw.glob("*/*") if path.is_file() or path.name in NOT_SENSORS)
    folders = (path for path in raw.glob("*/*/*") if path.is_dir())
    return {str(path): stamp(path) for path in sorted([*files, *folders])}


def _counts(path: Path, folder: Path) -> bool:
    hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
    return path.is_file() and not hidden
