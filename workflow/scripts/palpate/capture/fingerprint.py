"""Stamps of what people drop in, so that a changed image re-runs what uses it, and is noticed."""

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path

from palpate.capture.discover import NOT_OBJECTS, NOT_SENSORS


def folder_fingerprint(folder: str | Path, *, linked: int = 0) -> str:
    """Digest the names, sizes and modification times of a folder's files.

    Reading the images themselves at every start would take minutes for a large study; size and
    time change with every ordinary way of replacing a file.

    Parameters
    ----------
    folder : path
        Folder of a capture, itself a link or not; hidden files are passed over.
    linked : int, optional
        Levels below it whose folders may be links: 2 in an object's, for sensors and captures.

    Returns
    -------
    str
        Sixteen hexadecimal digits.
    """
    digest = hashlib.sha256()
    for parts, status in sorted(_files(str(folder), (), linked), key=lambda file: file[0]):
        entry = f"{'/'.join(parts)} {status.st_size} {status.st_mtime_ns}\n"
        digest.update(entry.encode())
    return digest.hexdigest()[:16]


def _files(
    folder: str, parts: tuple[str, ...], linked: int
) -> Iterator[tuple[tuple, os.stat_result]]:
    """Visible files below a folder; a linked folder is entered on the first levels alone."""
    try:
        entries = list(os.scandir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return
    for entry in entries:
        if entry.name.startswith("."):
            continue
        if entry.is_dir(follow_symlinks=linked > 0):
            yield from _files(entry.path, (*parts, entry.name), linked - 1)
        elif _is_file(entry):
            yield (*parts, entry.name), entry.stat()


def _is_file(entry: os.DirEntry) -> bool:
    try:
        return entry.is_file()
    except OSError:  # a link to itself, which the check of captures tells of
        return False


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


def stamps_below(raw: str | Path, *, only: str | None = None) -> dict[str, str]:
    """Stamp whatever may stand in ``raw/`` for a rule to read, by path.

    Parameters
    ----------
    raw : path
        Its objects' files, scans, backgrounds and captures, and experiments on sensors.
    only : str, optional
        Of the objects, the one that is read.
    """
    tops = [path for path in Path(raw).glob("*") if path.name in {only or path.name, *NOT_OBJECTS}]
    below = [path for top in tops for path in top.glob("*")]
    files = [path for path in below if path.is_file() or path.name in NOT_SENSORS]
    folders = [path for place in below for path in place.glob("*") if path.is_dir()]
    return {str(path): stamp(path) for path in sorted([*files, *folders])}
