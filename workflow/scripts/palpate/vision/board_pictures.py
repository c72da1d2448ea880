"""Pictures of a target in folders, as people keep them: one folder for each camera."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
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
    """Find a target in the pictures of one or two folders.

    Pictures of two folders are pairs by equal names, or else in the order of their names.

    Raises
    ------
    ValueError
        If a folder has no pictures, one can't be read or is of another size, none shows the
        target, or two folders without equal names have different numbers of pictures.
    """
    files = [_pictures(folder) for folder in folders]
    if len(files) > 1 and not set(files[0]) & set(files[1]):
        if len(files[0]) != len(files[1]):
            raise ValueError(
                f"{folders[1]}: pictures: expected {len(files[0])} as in {folders[0]}, or equal"
                f" names, found {len(files[1])}"
            )
        files[1] = dict(zip(files[0], files[1].values(), strict=True))
    return [_found(*of_folder, board) for of_folder in zip(folders, files, strict=True)]


def _pictures(folder: Path) -> dict[str, Path]:
    """Pictures of a folder by name, in the order of their names."""
    paths = sorted(p for p in folder.iterdir() if p.suffix.lower() in ENDINGS and p.is_file())
    if not paths:
        raise ValueError(f"{folder}: pictures: expected PNG, TIFF or JPEG files, found none")
    found: dict[str, Path] = {}
    for path in paths:
        if path.stem in found:
            raise ValueError(
                f"{folder}: names: expected one picture of a name, found {path.stem} twice"
            )
        found[path.stem] = path
    return found


def _found(folder: Path, files: Mapping[str, Path], board: FlatBoard) -> BoardPictures:
    images, coloured = {}, False
    for name, path in files.items():
        image = _read(path)
        coloured |= image.ndim == 3
        images[name] = _grey(image)
        (height, width), (h, w) = next(iter(images.values())).shape, images[name].shape
        if (height, width) != (h, w):
            raise ValueError(
                f"{path}: picture: expected {width} x {height} pixels as the first, found {w} x {h}"
            )
    return board_in(folder, images, board, coloured=coloured)


def board_in(
    source: str | Path, images: Mapping[str, NDArray], board: FlatBoard, *, coloured: bool = False
) -> BoardPictures:
    """Find a target in grey pictures (h, w) of one size, by view.

    Raises
    ------
    ValueError
        If none shows the target.
    """
    corners, missing = {}, {}
    for view, grey in images.items():
        found = board.find(grey)
        if found is None:
            missing[view] = "the target was not found"
        else:
            corners[view] = found
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
