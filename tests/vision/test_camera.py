"""The pinhole camera and its lens."""

import numpy as np
import pytest
from palpate.vision.camera import camera_from_spec


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
