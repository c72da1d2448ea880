"""The lab's ChArUco target, as the tool's reader sees it."""

import numpy as np
import pytest
from palpate.vision.marker import board_of
from virtual_lab.probe import BLACK, WHITE, make_probe, make_target

MARKER = {"kind": "charuco", "squares": [7, 5], "square_m": 0.015, "tag_m": 0.01125}
MARKER |= {"dictionary": "4X4_50"}


def test_its_colours_are_what_is_printed(probe):
    """Sharp in the middle of cells; the mean over a wide footprint; white beyond."""
    target, printed = make_target(MARKER), board_of(MARKER)
    v, u = np.mgrid[-0.9375:4:0.125, -0.9375:6:0.125]
    points = np.column_stack([u.ravel(), v.ravel(), np.zeros(u.size)]) * 0.015
    sharp = target.colour(points, np.full(u.size, 1e-4))[:, 0]
    white = printed.print.at(u.ravel(), v.ravel())
    assert sharp == pytest.approx(BLACK + (WHITE - BLACK) * white)
    middle = np.array([[2.5, 1.5, 0.0]]) * 0.015
    wide = target.colour(middle, np.array([7 * 0.015]))
    tall_share = 5 / 7
    dark = (WHITE - wide[0, 0]) / (WHITE - BLACK)
    assert dark == pytest.approx(tall_share * (1 - white.mean()), rel=1e-6)
    beyond = target.colour(np.array([[0.2, 0.0, 0.0], [0.0, 0.0, 0.003]]), np.full(2, 1e-4))
    assert beyond == pytest.approx(WHITE)
    assert make_probe(probe | {"marker": MARKER}).target.squares == (7, 5)


def test_targets_that_the_lab_does_not_have():
    with pytest.raises(ValueError, match="marker.kind: expected checkerboard or charuco"):
        make_target({"kind": "aprilgrid"})
    with pytest.raises(ValueError, match="tag_m: expected a simple part of square_m"):
        make_target(MARKER | {"tag_m": 0.015 / np.pi})
