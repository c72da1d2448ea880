"""What the lab's tests share: its file, a made-up indentation, sensors of few pixels."""

import copy

import numpy as np
import pytest
from palpate.workflow.configuration import like_another
from virtual_lab.load_steps import LoadSteps
from virtual_lab.record import with_motion
from virtual_lab.rig import object_bench
from virtual_lab.shapes import shape_of

POINT = np.array([-0.05, 0.0, 0.0475])
LENGTHS, SIZES = ("fx_px", "fy_px", "cx_px", "cy_px"), ("width_px", "height_px")


@pytest.fixture(scope="session")
def lab(root):
    """The default lab, and what a robot, a tracker or clouds record of it."""
    return like_another(root / "config/robot_lab.yaml")


@pytest.fixture(scope="session")
def common(lab):
    return {key: lab[key] for key in lab if key not in ("objects", "experiments")}


@pytest.fixture(scope="session")
def spec(lab):
    motion = {"frames": 3, "frame_rate_hz": 1, "tilt_deg": 0.0}
    return with_motion(lab["objects"]["foam_block"], motion)


@pytest.fixture(scope="session")
def bench(common, spec):
    return object_bench(common, spec, name="foam_block")


@pytest.fixture(scope="session")
def steps(spec):
    """The recordings need no mechanics here."""
    rest, faces = shape_of(spec).surface()
    depth = np.linspace(0, 0.009, 10)
    dent = np.exp(-(((rest - POINT) / 0.03) ** 2).sum(axis=1))
    fields = -depth[:, None, None] * dent[None, :, None] * [0, 0, 1]
    return LoadSteps(POINT, depth, 200 * depth**1.5, rest, faces, fields)


def shrunk(sensors, by):
    """The same sensors with fewer pixels along each side."""
    found = copy.deepcopy(sensors)
    for spec in found.values():
        for camera in (spec[key] for key in ("color", "depth") if key in spec):
            camera |= {key: camera[key] / by for key in LENGTHS}
            camera |= {key: camera[key] // by for key in SIZES}
    return found


@pytest.fixture(scope="session")
def small(sensors):
    return shrunk(sensors, 4)


@pytest.fixture(scope="session")
def half(sensors):
    return shrunk(sensors, 2)
