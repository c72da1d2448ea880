"""Points and masks, the board's sheet, and arrays that belong together."""

import json

import numpy as np
import pytest
from palpate.vision.camera import PinholeCamera, sensor_with_optics
from palpate.vision.clouds import _deprojected, _sheet, in_mask

CAMERA = PinholeCamera(8, 6, 10.0, 20.0, 3.5, 2.5)


def at(pixel, z_m=2.0):
    x, y = pixel
    return np.array([(x - 3.5) / 10, (y - 2.5) / 20, 1.0]) * z_m


def test_points_in_a_mask():
    """To the nearest pixel, and outside the image in none."""
    mask = np.zeros((6, 8), bool)
    mask[1, 2] = mask[5, 7] = mask[0, 0] = True
    inside = [(2, 1), (2.4, 0.6), (7.4, 5.4), (-0.4, -0.4)]
    outside = [(2.6, 1), (2, 1.6), (7.6, 5), (7, 5.6), (-0.6, 0), (0, -0.6), (3, 3)]
    found = in_mask(np.array([at(pixel) for pixel in (*inside, *outside)]), mask, CAMERA)
    assert found.tolist() == [True] * 4 + [False] * 7


def test_depths_within_the_range_become_points():
    depth = np.full((6, 8), np.nan)
    depth[1, 2], depth[5, 7], depth[0, 0], depth[3, 3] = 0.5, 2.0, 0.49, 2.01
    found = _deprojected(depth, CAMERA, (0.5, 2.0))
    assert found == pytest.approx(np.stack([at((2, 1), 0.5), at((7, 5), 2.0)]))


def test_the_sheet_has_an_even_margin_and_its_corners_on_the_radius():
    probe = {
        "marker": {"inner_corners": [4, 3], "square_m": 0.02},
        "exclusion": {"board_radius_m": 0.08},
    }
    sheet = _sheet(probe)
    assert np.linalg.norm(sheet, axis=1) == pytest.approx(0.08)
    width, height = np.ptp(sheet, axis=0)[:2]
    assert width - 5 * 0.02 == pytest.approx(height - 4 * 0.02) and width > 0.1
    # Around it in one way.
    assert np.sign(np.cross(sheet, np.roll(sheet, -1, axis=0))[:, 2]).tolist() == [1] * 4
    # A radius within the squares leaves them as they are.
    probe["exclusion"]["board_radius_m"] = 0.05
    assert np.ptp(_sheet(probe), axis=0) == pytest.approx([0.1, 0.08, 0])


def test_optics_of_a_calibration_go_before_the_files(tmp_path):
    spec = {"color": {"fx_px": 500.0, "width_px": 640}, "depth": {"fx_px": 580.0}}
    assert sensor_with_optics(spec, None) is spec and sensor_with_optics(spec, []) is spec
    rest = {"fy_px": 1, "cx_px": 2, "cy_px": 3, "distortion": [0.0] * 5}
    cameras = {name: rest | {"fx_px": fx} for name, fx in (("color", 501), ("infrared", 581))}
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps({"cameras": cameras, "color_from_infrared": [[1]]}))
    found = sensor_with_optics(spec, path)
    assert (found["color"]["fx_px"], found["depth"]["fx_px"]) == (501, 581)
    assert found["color"]["width_px"] == 640 and found["depth"]["color_from_depth"] == [[1]]
    assert spec["color"]["fx_px"] == 500.0
