"""Fingerprint of a folder that people drop in, so that a changed image re-runs what uses it."""

import hashlib
import os
from collections.abc import Iterator
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
    digest = hashlib.sha256()
    for parts, status in sorted(_files(str(folder), ()), key=lambda file: file[0]):
        entry = f"{'/'.join(parts)} {status.st_size} {status.st_mtime_ns}\n"
        digest.update(entry.encode())
    return digest.hexdigest()[:16]


def _files(folder: str, parts: tuple[str, ...]) -> Iterator[tuple[tuple, os.stat_result]]:
    """Visible files below a folder; a linked folder is not entered."""
    try:
        entries = list(os.scandir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return
    for entry in entries:
        if entry.name.startswith("."):
            continue
        if entry.is_dir(follow_symlinks=False):
            yield from _files(entry.path, (*parts, entry.name))
        elif entry.is_file():
            yield (*parts, entry.name), entry.stat()
