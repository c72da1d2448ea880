"""Files and folders that are written whole or not at all."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Give a path to write to; it becomes ``path`` when the block ends without an error.

    Parameters
    ----------
    path : path
        Where the file is to stand.

    Yields
    ------
    Path
        A hidden sibling with the same ending.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".part-{path.name}")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def whole_folder(path: str | Path, *, replace: bool = True) -> Iterator[Path]:
    """Give an empty folder to fill; it becomes ``path`` when the block ends without an error.

    Parameters
    ----------
    path : path
        Where the folder is to stand.
    replace : bool, optional
        Whether what stands there is replaced, or refused.

    Yields
    ------
    Path
        A hidden sibling folder.

    Raises
    ------
    ValueError
        If something stands there that is not to be replaced.
    """
    path = Path(path)
    if not replace:
        _check_free(path)
    part = path.with_name(f".part-{path.name}")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    try:
        yield part
        if replace:
            shutil.rmtree(path, ignore_errors=True)
        else:
            _check_free(path)
        os.replace(part, path)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _check_free(path: Path) -> None:
    if os.path.lexists(path):
        raise ValueError(f"{path}: folder: expected nothing there yet, found something")
