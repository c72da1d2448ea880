"""Pictures of a board in folders, as people keep them: one folder for each camera."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard, board_views
from palpate.yaml_files import one_line

ENDINGS = (".png", ".tif", ".tiff", ".jpg", ".jpeg")
# Of pictures of 16 bits, the share that may be brighter than white: glints.
GLINTS_PERCENT = 99.5


@dataclass(frozen=True)
class BoardPictures:
    """What was found in a folder's pictures.

    Attributes
    ----------
    folder : path
    corners : dict
        View to its corners (n, 2) [px].
    missing : dict
        View to why there are none.
    size_px : (width, height)
    coloured : bool
        Whether the pictures have colours.
    """

    folder: str | Path
    corners: dict[str, NDArray]
    missing: dict[str, str]
    size_px: tuple[int, int]
    coloured: bool


def read_pictures(folders: Sequence[Path], board: FlatBoard) -> list[BoardPictures]:
    """Find a board in the pictures of one or two folders.

    Pictures of two folders are pairs by equal names, or else in the order of their names.

    Raises
    ------
    ValueError
        If a folder has no pictures, one can't be read or is of another size, none shows the
        board, or two folders without equal names have different numbers of pictures.
    """
    files = [_pictures(folder) for folder in folders]
    names = [[path.stem for path in own] for own in files]
    for own, folder in zip(names, folders, strict=True):
        if len(set(own)) < len(own):
            twice = next(name for name in own if own.count(name) > 1)
            raise ValueError(
                f"{folder}: names: expected one picture of a name, found {twice} twice"
            )
    if len(folders) > 1 and not set(names[0]) & set(names[1]):
        counts = [len(own) for own in names]
        if counts[0] != counts[1]:
            raise ValueError(
                f"{folders[1]}: pictures: expected {counts[0]} as in {folders[0]}, or equal names,"
                f" found {counts[1]}"
            )
        names[1] = names[0]
    return [
        _found(folder, dict(zip(own, paths, strict=True)), board)
        for folder, own, paths in zip(folders, names, files, strict=True)
    ]


def _pictures(folder: Path) -> list[Path]:
    found = sorted(p for p in folder.iterdir() if p.suffix.lower() in ENDINGS and p.is_file())
    if not found:
        raise ValueError(f"{folder}: pictures: expected PNG, TIFF or JPEG files, found none")
    return found


def _found(folder: Path, files: dict[str, Path], board: FlatBoard) -> BoardPictures:
    images, coloured = {}, False
    for name, path in files.items():
        image = _read(path)
        coloured |= image.ndim == 3
        images[name] = _grey(image)
        if images[name].shape != next(iter(images.values())).shape:
            (h, w), (height, width) = images[name].shape, next(iter(images.values())).shape
            raise ValueError(
                f"{path}: picture: expected {width} x {height} pixels as the first, found {w} x {h}"
            )
    return board_in(folder, images, board, coloured=coloured)


def board_in(
    source: str | Path, images: Mapping[str, NDArray], board: FlatBoard, *, coloured: bool = False
) -> BoardPictures:
    """Find a board in grey pictures (h, w) of one size, by view.

    Raises
    ------
    ValueError
        If none shows the board.
    """
    corners, missing = board_views(list(images.items()), board)
    if not corners:
        found = f"none in {len(images)} pictures"
        raise ValueError(f"{source}: pictures: expected {board.described}, found {found}")
    height, width = next(iter(images.values())).shape
    return BoardPictures(source, corners, missing, (width, height), coloured)


def _read(path: Path) -> NDArray:
    content = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    image = cv2.imdecode(content, cv2.IMREAD_UNCHANGED) if len(content) else None
    if image is None or image.dtype not in (np.uint8, np.uint16):
        raise ValueError(
            one_line(f"{path}: picture: expected PNG, TIFF or JPEG, found one that can't be read")
        )
    return image


def _grey(image: NDArray) -> NDArray:
    """Eight bits of grey."""
    if image.ndim == 3:
        image = cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2GRAY)
    if image.dtype == np.uint8:
        return image
    white = max(float(np.percentile(image, GLINTS_PERCENT)), 1.0)
    return np.clip(image * (255 / white), 0, 255).astype(np.uint8)
