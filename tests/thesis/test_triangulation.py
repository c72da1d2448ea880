"""Figures 4.2, 4.3 and 4.8: the drawn points obey Eq. 4.1 to 4.8, and bytes repeat."""

import numpy as np
import pytest
from palpate.capture.images import depth_of
from palpate.report import style
from palpate.vision.camera import camera_from_spec
from thesis.chapter4 import pinhole_figure, triangulation


def texts(figure):
    return " ".join(text.get_text() for text in figure.findobj(style.matplotlib.text.Text))


@pytest.mark.parametrize("depth_m", [0.5, 0.85, 7.9])
def test_disparity_of_the_drawn_point_gives_its_depth(sensors, depth_m):
    spec = sensors["bumblebee"]
    shape = triangulation.triangle(spec["color"], spec["stereo"]["baseline_m"], depth_m)
    product = spec["color"]["fx_px"] * spec["stereo"]["baseline_m"]
    assert product / shape.disparity_px == pytest.approx(depth_m, rel=1e-12)
    camera = camera_from_spec(spec["color"])
    seen = camera.project([[shape.x_m, 0, depth_m], [shape.x_m - 0.12, 0, depth_m]])[:, 0]
    assert (shape.first_px, shape.second_px) == pytest.approx(tuple(seen), abs=1e-6)


def test_counts_and_depth_are_the_sensors_own(sensors):
    spec = sensors["kinect"]["depth"]
    counts = np.arange(400, 1050)
    image = depth_of(counts[None].astype(np.uint16), spec)[0]
    assert triangulation.depth_of(spec, counts) == pytest.approx(image, rel=1e-6)
    disparity = spec["fx_px"] * spec["baseline_m"] / triangulation.depth_of(spec, counts)
    assert triangulation.counts_of(spec, disparity) == pytest.approx(counts)


@pytest.mark.parametrize(("baseline_m", "depth_m"), [(0.0, 1.0), (0.1, -1.0)])
def test_lengths_are_positive(sensors, baseline_m, depth_m):
    with pytest.raises(ValueError, match=r"_m: expected a positive length, found (0\.0|-1\.0) m"):
        triangulation.triangle(sensors["kinect"]["color"], baseline_m, depth_m)


def test_marked_image_points_lie_on_the_rays(sensors):
    spec = sensors["kinect"]["depth"]
    shape = triangulation.triangle(spec, spec["baseline_m"], 0.85)
    x, z = triangulation._on_plane(shape, shape.first_px)
    assert x / z == pytest.approx(shape.x_m / shape.z_m)
    other, _ = triangulation._on_plane(shape, shape.second_px)
    assert (x - other) / z == pytest.approx(shape.baseline_m / shape.z_m)


def test_figures_show_the_configured_numbers(sensors):
    with style.journal():
        found = texts(triangulation.figure_4_2(sensors["kinect"], depth_m=0.85))
        assert "584.6 px" in found
        assert "= 75 mm" in found
        assert "51.6 px" in found
        found = texts(triangulation.figure_4_3(sensors["bumblebee"], depth_m=0.65))
        assert "790.0 px" in found
        assert "= 120 mm" in found
        assert "145.8 px" in found
    style.plt.close("all")


def test_pinhole_point_projects_onto_its_image_point(sensors):
    camera = camera_from_spec(sensors["kinect"]["color"] | {"distortion": [0.0] * 5})
    pixel, point = pinhole_figure.shown_point(camera, 0.85)
    assert camera.project(point)[0] == pytest.approx(pixel, abs=1e-6)
    assert point[2] == pytest.approx(0.85)
    assert (pixel > 0).all()
    assert (pixel < [640, 480]).all()


def test_pinhole_figure_needs_a_depth(sensors):
    with pytest.raises(ValueError, match="depth_m: expected a positive length, found 0 m"):
        pinhole_figure.figure_4_8(sensors["kinect"]["color"], depth_m=0, name="kinect")


def test_bytes_are_the_same_each_time(sensors, tmp_path):
    for k in "ab":
        with style.journal():
            figure = pinhole_figure.figure_4_8(
                sensors["kinect"]["color"], depth_m=0.85, name="kinect"
            )
            style.save(figure, tmp_path / f"{k}.png", tmp_path / f"{k}.svg")
    for ending in ("png", "svg"):
        one, other = ((tmp_path / f"{k}.{ending}").read_bytes() for k in "ab")
        assert one == other
