"""Fingerprint of a folder that people drop in, so that a changed image re-runs what uses it."""

import hashlib
from pathlib import Path


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


def _counts(path: Path, folder: Path) -> bool:
    hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
    return path.is_file() and not hidden
