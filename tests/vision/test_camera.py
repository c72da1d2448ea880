"""The pinhole camera and its lens."""

import json

import numpy as np
import pytest
from palpate.vision.camera import camera_from_spec, sensor_with_optics


@pytest.mark.parametrize("block", ["color", "depth"])
def test_rays_take_the_distortion_out(sensors, block):
    camera = camera_from_spec(sensors["kinect"][block])
    pixels = camera.pixel_grid()[::37]
    assert np.abs(camera.project(camera.rays(pixels) * 1.3) - pixels).max() < 1e-4
    straight = camera.rays(pixels)[:, :2] * [camera.fx_px, camera.fy_px]
    moved = np.linalg.norm(straight + [camera.cx_px, camera.cy_px] - pixels, axis=1)
    # The lens is one: it matters in the corners and hardly in the middle.
    assert moved.max() > 5
    assert moved[np.linalg.norm(pixels - [camera.cx_px, camera.cy_px], axis=1) < 40].max() < 0.3


def test_optics_of_a_calibration_go_before_the_files(tmp_path):
    spec = {"color": {"fx_px": 500.0, "width_px": 640}}
    spec["depth"] = {"fx_px": 580.0, "infrared_shift_px": [5, 4]}
    assert sensor_with_optics(spec, None) is spec and sensor_with_optics(spec, []) is spec
    rest = {"fy_px": 1, "cx_px": 2, "cy_px": 3, "distortion": [0.0] * 5}
    cameras = {name: rest | {"fx_px": fx} for name, fx in (("color", 501), ("infrared", 581))}
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps({"cameras": cameras, "color_from_infrared": [[1]]}))
    found = sensor_with_optics(spec, path)
    assert (found["color"]["fx_px"], found["depth"]["fx_px"]) == (501, 581)
    assert (found["depth"]["cx_px"], found["depth"]["cy_px"]) == (2 - 5, 3 - 4)
    assert found["color"]["width_px"] == 640 and found["depth"]["color_from_depth"] == [[1]]
    assert spec["color"]["fx_px"] == 500.0
