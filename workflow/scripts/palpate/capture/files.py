"""Files and folders that are written whole or not at all."""

import errno
import json
import os
import secrets
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

# Begins the hidden name under which a file or folder stands until it is whole.
PART = ".part-"
NO_SPACE = (errno.ENOSPC, errno.EDQUOT)


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Give a path to write to; it becomes ``path`` when the block ends without an error.

    The content is on the disk before it gets its name, so that a power cut leaves all or nothing.
    Until then it is a hidden sibling with the same ending, which no other writer shares.

    Raises
    ------
    OSError
        That names the file if there is no space for it, or no writing there.
    """
    with _part_of(path := Path(path)) as part:
        yield part
        _to_disk(part)
        os.replace(part, path)


@contextmanager
def whole_folder(path: str | Path, *, replace: bool = True, kept: str = "") -> Iterator[Path]:
    """Give an empty folder to fill; it becomes ``path`` when the block ends without an error.

    Parameters
    ----------
    path : path
        Of the folder; what is given to write in is a hidden sibling that no other writer shares.
    replace : bool, optional
        Whether what stands there is replaced, or rejected.
    kept : str, optional
        Name of a folder that may stand there alone already, and stays.

    Raises
    ------
    ValueError
        If something stands there that is not to be replaced.
    OSError
        That names the folder if there is no space for it.
    """

    def check_free() -> None:
        alone = path.is_dir() and os.listdir(path) == [kept]
        if os.path.lexists(path) and not (replace or alone):
            raise ValueError(f"{path}: folder: expected nothing there yet, found something")

    path = Path(path)
    check_free()
    with _part_of(path) as part:
        part.mkdir()
        yield part
        for file in part.rglob("*"):
            _to_disk(file)
        check_free()
        if path.is_dir() and not replace:
            # What is kept never moves; tables, by which a folder is whole, come last.
            for one in sorted(part.iterdir(), key=Path.is_file):
                os.replace(one, path / one.name)
            return
        if path.is_dir():
            # Taken away at once: one that is half removed must never stand under its name.
            os.replace(path, aside := _sibling(path))
            shutil.rmtree(aside, ignore_errors=True)
        os.replace(part, path)


def write_text(path: str | Path, text: str) -> None:
    """Write a text, whole or not at all."""
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")


def write_json(path: str | Path, fields: Mapping) -> None:
    """Write a mapping as JSON, whole or not at all."""
    write_text(path, json.dumps(fields, indent=2) + "\n")


def remove_parts(folder: str | Path, *, unless: str) -> None:
    """Remove what writers that were killed left behind in a folder and below it.

    Nobody may be writing there. Folders below with a file ``unless`` are passed over: others may.
    """
    top = Path(folder)
    for place, folders, files in os.walk(top):
        if unless in files and Path(place) != top:
            folders.clear()
            continue
        for name in [*folders, *files]:
            if name.startswith(PART):
                _remove(Path(place, name))
        folders[:] = [name for name in folders if not name.startswith(PART)]


@contextmanager
def _part_of(path: Path) -> Iterator[Path]:
    """A hidden sibling of a file or folder; it is gone after the block, whatever happens."""
    part = _sibling(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        yield part
    except OSError as error:
        full = error.errno in NO_SPACE and error.filename is None
        if full or error.filename == str(part):
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise
    finally:
        _remove(part)


def _sibling(path: Path) -> Path:
    return path.with_name(f"{PART}{secrets.token_hex(4)}-{path.name}")


def _to_disk(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _remove(part: Path) -> None:
    if part.is_dir():
        shutil.rmtree(part, ignore_errors=True)
    else:
        part.unlink(missing_ok=True)
