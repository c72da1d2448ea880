"""What the lab's tests share: its file, a made-up indentation, sensors of few pixels."""

import copy

import numpy as np
import pytest
import yaml
from palpate.workflow.configuration import like_another
from virtual_lab.load_steps import LoadSteps
from virtual_lab.record import record_capture, with_motion
from virtual_lab.rig import make_rig, object_bench
from virtual_lab.rig_errors import errors_of
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


@pytest.fixture
def recorded(common, spec, bench, steps, probe, tmp_path):
    """A small capture of an object with changes: its folder and its truth."""

    def record(name, sensor, *, seed=2, jolted_m=None, folder="capture", **changes):
        ours = spec | changes
        place = errors_of(common, ours, sensor), ours["cameras"][name], bench
        more = {} if jolted_m is None else {"jolted": make_rig(common, *place, jolted_m=jolted_m)}
        (tmp_path / folder).mkdir()
        given = tmp_path / folder, make_rig(common, *place), steps, ours, probe
        return tmp_path / folder, record_capture(*given, seed=[1, seed], **more)

    return record


@pytest.fixture
def files_of():
    """Names and contents of a folder's files."""
    return lambda of: {str(p.relative_to(of)): p.read_bytes() for p in of.rglob("*") if p.is_file()}


@pytest.fixture
def own(root):
    """The own object's lab, its sensor and its probe."""
    files = ("lab.yaml", "sensors/bench_cam.yaml", "probes/bench_probe.yaml")
    return [yaml.safe_load((root / "tests/own_object" / file).read_text()) for file in files]
