"""Figures 4.11 and 4.12: the pixel and the chain that they show, and their labels."""

import numpy as np
import pandas as pd
import pytest
from palpate.report import style
from palpate.vision.background import BackgroundModel
from palpate.vision.probe import MARKER, QUATERNION, marker_from_tip
from thesis.chapter4 import colour_model, colour_pixel, transform_chain

SHAPE = (40, 60)
TABLE, FOAM = (180.0, 155.0, 130.0), (115, 128, 143)
BOUNDS = (0.55, 1.5)
CAMERA = {
    "width_px": 640,
    "height_px": 480,
    "fx_px": 500.0,
    "fy_px": 500.0,
    "cx_px": 319.5,
    "cy_px": 239.5,
}


@pytest.fixture
def model():
    mean = np.tile(np.array(TABLE, np.float32), (*SHAPE, 1))
    std = np.ones_like(mean)
    return BackgroundModel(
        mean=mean,
        std=std,
        brightness_rms=np.full(SHAPE, 0.004, np.float32),
        chromaticity_rms=np.full(SHAPE, 1.4, np.float32),
        brightness_threshold=3.0,
        threshold=4.0,
    )


@pytest.fixture
def scene():
    mask = np.zeros(SHAPE, bool)
    mask[10:30, 20:50] = True
    image = np.tile(np.array(TABLE, np.uint8), (*SHAPE, 1))
    image[mask] = np.array(FOAM) + 4
    image[20, 30] = FOAM
    image[20, 40:42] = (20, 200, 60)
    image[22, 32:44] = np.array(FOAM) - 4
    return image, mask


@pytest.fixture
def samples():
    return np.random.default_rng(2).normal(TABLE, 1.0, (6, 3)).round()


@pytest.fixture
def pose(probe):
    quaternion = np.array([0.19, -0.01, 0.02, 0.0])
    quaternion[3] = np.sqrt(1 - quaternion @ quaternion)
    table = pd.DataFrame({"frame": [0, 1], "detected": [0, 1]})
    table[QUATERNION] = quaternion
    table[MARKER] = [[0.0, 0.0, 0.5], [-0.07, -0.11, 0.53]]
    return table


def texts(figure):
    return {text.get_text() for text in figure.findobj(style.matplotlib.text.Text)}


def test_pixel_is_a_typical_one_off_the_rim(model, scene):
    image, mask = scene
    chosen = [colour_pixel.choose_pixel(model, image, mask, alpha_low=0.55) for _ in range(2)]
    # All foam off the rim is alike but for a few pixels: the first of them, row by row.
    assert chosen[0] == chosen[1] == (13, 23)
    shrunk = np.zeros_like(mask)
    shrunk[17:24, 27:34] = True
    assert colour_pixel.choose_pixel(model, image, shrunk, alpha_low=0.55) == (20, 30)


def test_unlike_deviations_are_passed_over(model, scene):
    image, mask = scene
    model.std[:, :40, 0] = 2.0
    row, column = colour_pixel.choose_pixel(model, image, mask, alpha_low=0.55)
    assert (row, column) == (13, 40)


def test_no_pixel_that_shows_the_model(model, scene):
    image, mask = scene
    with pytest.raises(ValueError, match="expected a pixel that shows the colour model, found"):
        colour_pixel.choose_pixel(model, image, np.zeros_like(mask), alpha_low=0.55)


def test_grey_images_have_no_colour_model(model, scene):
    image, mask = scene
    with pytest.raises(ValueError, match=r"expected \(h, w, 3\) colours, found shape \(40, 60\)"):
        colour_pixel.choose_pixel(model, image[..., 0], mask, alpha_low=0.55)


def test_distortions_of_equal_deviations_are_those_of_a_perpendicular(model, scene, samples):
    shown = colour_pixel.pixel_colour(model, scene[0], samples, (20, 30))
    E, colour = np.array(TABLE), np.array(FOAM)
    assert shown.alpha == pytest.approx(colour @ E / (E @ E), rel=1e-5)
    across = np.linalg.norm(np.cross(colour, E)) / np.linalg.norm(E)
    assert shown.chromaticity == pytest.approx(across / 1.4, rel=1e-4)
    assert shown.sample_alpha == pytest.approx(samples @ E / (E @ E), rel=1e-4)


def test_samples_are_colours(model, scene):
    with pytest.raises(ValueError, match=r"samples: expected shape \(n, 3\), found \(6,\)"):
        colour_pixel.pixel_colour(model, scene[0], np.zeros(6), (20, 30))


def test_the_chromaticity_line_keeps_its_length_and_direction():
    view = colour_model._colour_view(np.array(TABLE), np.array(FOAM, float))
    assert view.T @ view == pytest.approx(np.eye(2), abs=1e-12)
    across, up = np.array(TABLE) @ view
    assert np.hypot(across, up) == pytest.approx(np.linalg.norm(TABLE))
    assert np.degrees(np.arctan2(up, across)) == pytest.approx(colour_model.RISE_DEG)


def test_figure_4_11_names_what_it_shows(model, scene, samples):
    shown = colour_pixel.pixel_colour(model, scene[0], samples, (20, 30))
    with style.journal():
        figure = colour_model.figure_4_11(
            shown, scene[0], (20, 30), alpha_bounds=BOUNDS, provenance="simulated"
        )
    names = {colour_model.EXPECTED, colour_model.PROJECTED, colour_model.COLOUR}
    names |= {"R", "G", "B", "$CD_i$", "6 background frames", "simulated captures"}
    assert names <= texts(figure)
    style.plt.close(figure)


def test_chain_ends_at_the_tip(pose, probe):
    frames = transform_chain.chain(pose, probe)
    assert list(frames) == ["camera", "marker", "force", "tip"]
    assert frames["marker"][:3, 3] == pytest.approx(pose[MARKER].to_numpy()[1])
    assert frames["tip"] == pytest.approx(frames["marker"] @ marker_from_tip(probe))


def test_chain_needs_the_marker(pose, probe):
    with pytest.raises(ValueError, match="expected a frame with the marker, found none of 2"):
        transform_chain.chain(pose.assign(detected=0), probe)


def test_figure_4_12_names_the_transforms_and_draws_to_scale(pose, probe):
    with style.journal():
        figure = transform_chain.figure_4_12(pose, probe, CAMERA, provenance="recorded")
    found = texts(figure)
    assert {"camera", "marker", "force sensor", "tip", "radius 6.22 mm"} <= found
    for symbol, words in (
        (transform_chain.CHESSBOARD, "camera from marker"),
        (transform_chain.SENSOR, "marker from force"),
        (transform_chain.TIP, "force from tip\n60 mm"),
    ):
        assert any(text.startswith(f"{symbol}\n{words}") for text in found)
    radii = {c.radius for c in figure.findobj(style.matplotlib.patches.Circle)}
    assert probe["indenter"]["radius_m"] in radii
    assert "simulated captures" not in found
    style.plt.close(figure)


def test_figures_are_the_same_bytes_each_time(pose, probe, tmp_path):
    for k in "ab":
        with style.journal():
            figure = transform_chain.figure_4_12(pose, probe, CAMERA, provenance="simulated")
            style.save(figure, tmp_path / f"{k}.png", tmp_path / f"{k}.svg")
    for ending in ("png", "svg"):
        one, other = ((tmp_path / f"{k}.{ending}").read_bytes() for k in "ab")
        assert one == other
