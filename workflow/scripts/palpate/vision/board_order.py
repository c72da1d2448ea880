"""Which end of a board is which, where it looks the same after half a turn."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import Board
from palpate.vision.first_guess import board_pose, matrix_of

# Of the angle by which views ordered alike may be apart, over that of the other order.
CLEARLY = 0.2


def ordered_alike(
    first: Mapping[str, NDArray],
    second: Mapping[str, NDArray],
    board: Board,
    lenses: tuple[NDArray, NDArray],
) -> dict[str, NDArray]:
    """Turn the second camera's corners so that all views give about one transform.

    Parameters
    ----------
    first, second : mapping
        View to its corners (n, 2) [px], of the same views.
    board : Board
    lenses : two arrays (9,)

    Raises
    ------
    ValueError
        If the views don't settle the order.
    """
    options = {name: _options(first[name], second[name], board, lenses) for name in second}
    picked = min(
        (_nearest(options, guess) for pair in options.values() for _, guess in pair),
        key=lambda found: found[0],
    )
    cost, picked = picked
    others = [
        max(apart(option[1], picked[name][1]) for option in pair) for name, pair in options.items()
    ]
    if cost > CLEARLY * min(others):
        raise ValueError(
            "board: expected one odd and one even number of corners, or views that settle its"
            f" order, found {board.columns} x {board.rows}"
        )
    return {name: option[0] for name, option in picked.items()}


def apart(a: NDArray, b: NDArray) -> float:
    """Angle between two transforms [rad]."""
    cosine = (np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2
    return float(np.arccos(np.clip(cosine, -1, 1)))


def _options(first: NDArray, second: NDArray, board: Board, lenses: tuple) -> list[tuple]:
    """Both orders of the second camera's corners, with the transform that each gives."""
    known = np.linalg.inv(matrix_of(board_pose(first, board, lenses[0])))
    return [
        (seen, matrix_of(board_pose(seen, board, lenses[1])) @ known)
        for seen in (second, second[::-1].copy())
    ]


def _nearest(options: Mapping[str, list], guess: NDArray) -> tuple[float, dict]:
    """The orders nearest to a transform, and how far half of them are from it [rad]."""
    picked = {
        name: min(pair, key=lambda option: apart(option[1], guess))
        for name, pair in options.items()
    }
    return float(np.median([apart(option[1], guess) for option in picked.values()])), picked
