"""Where the board is looked for in the next frame."""

import numpy as np
from palpate.vision.marker import MARGIN, expected_region


def corners_at(x, y):
    return np.stack(np.meshgrid(x + 20.0 * np.arange(4), y + 20.0 * np.arange(3)), -1).reshape(
        -1, 2
    )


def test_where_the_board_should_be_next():
    """Moving on as it did, with a margin of a part of its longer side of 60 pixels."""
    margin = MARGIN * 60
    still = expected_region(corners_at(200, 100), None, (400, 600))
    assert (still.x0, still.y0) == (int(200 - margin), int(100 - margin))
    assert (still.x1, still.y1) == (int(np.ceil(260 + margin)), int(np.ceil(140 + margin)))
    moved = expected_region(corners_at(210, 95), corners_at(200, 100), (400, 600))
    assert (moved.x0 - still.x0, moved.y1 - still.y1) == (20, -10)
    cut = expected_region(corners_at(5, 380), None, (400, 600))
    assert (cut.x0, cut.y1) == (0, 400)
    assert expected_region(corners_at(700, 100), None, (400, 600)) is None
    assert expected_region(corners_at(200, -200), None, (400, 600)) is None
