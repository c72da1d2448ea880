"""What a stage ends with over input that it can't use: one line that names file and field."""

import numpy as np
import pandas as pd
import pytest
import trimesh
import yaml
from palpate.capture.tables import write_table
from palpate.surface.alignment import Alignment, save_alignment
from settings import full

SIZE, RADIUS = 0.1, 0.00622
TOP = np.array([0.05, 0.05, SIZE])
PROBE = {"indenter": {"radius_m": RADIUS}}
FAR = "depth: expected the tip within 5 mm of the surface when the force begins, found it"
SUPPORT = {"plane_point_m": [0, 0, 0], "plane_normal": [0, 0, 1], "tolerance_m": 1e-3}


def describe(path):
    content = {
        "template": {"unit": "m", "vertices": 50},
        "support": SUPPORT,
        "points": {"01": {"position_m": TOP.tolist()}},
    }
    path.write_text(yaml.safe_dump(content))
    return path


def write_forces(path, newtons):
    force = np.asarray(newtons, dtype=float)
    time = {"time_s": np.arange(len(force)) / 6}
    write_table(path, pd.DataFrame(time | {"fx_n": 0 * force, "fy_n": 0 * force, "fz_n": -force}))
    return path


@pytest.mark.parametrize(
    ("depths", "newtons", "baseline", "found"),
    [
        (
            *([-1e-3, 1e-3], [0, 1], False),
            "force.csv: depth: expected at least 2 samples in contact, found 1",
        ),
        (
            *([-1e-3, 1e-3, 2e-3], [0, 1, 2], True),
            "force.csv: samples: expected more than 3, found 3",
        ),
        (
            *(np.linspace(-0.02, -0.01, 5), [0, 0.5, 1, 1.5, 2], False),
            f"probe_pose.csv: {FAR} 17.5 mm above in frame 1",
        ),
        ([-0.02, 0.007, 0.008], [0, 1, 2], False, f"probe_pose.csv: {FAR} 7.0 mm below in frame 1"),
        (
            [-1e-3, 1e-3],
            [0, 0.05],
            False,
            "force.csv: force: expected above 0.1 N, found at most 0.05",
        ),
        ([-1e-3, 1e-3], [0.5, 0.9], False, "force.csv: force: expected samples before contact"),
    ],
)
def test_hertz_fit(stage, root, tmp_path, depths, newtons, baseline, found):
    """Of an indentation into the top of a box."""
    box = trimesh.creation.box((SIZE, SIZE, SIZE)).subdivide()
    box.apply_translation([SIZE / 2] * 3).export(tmp_path / "template.ply")
    save_alignment(tmp_path / "alignment.json", Alignment(np.eye(4), TOP, 1, 1e-4))
    tips = TOP + [0, 0, RADIUS] - np.outer(depths, [0, 0, 1])
    poses = dict(zip(("tip_x_m", "tip_y_m", "tip_z_m"), tips.T, strict=True))
    table = pd.DataFrame(poses | {"raw_tip_std_along_m": 0 * tips[:, 0]})
    write_table(tmp_path / "probe_pose.csv", table)
    (tmp_path / "clock.json").write_text('{"std_s": 0.02}')
    inputs = {
        "object": describe(tmp_path / "object.yaml"),
        "template": tmp_path / "template.ply",
        "alignment": tmp_path / "alignment.json",
        "pose": tmp_path / "probe_pose.csv",
        "force": write_forces(tmp_path / "force.csv", newtons),
        "clock": tmp_path / "clock.json",
    }
    config = full(root)
    params = {"options": config["hertz"] | {"baseline": baseline}, "probe": PROBE}
    params["rig"] = config["direct"]["fit"]["rig"]
    line = stage("hertz", inputs=inputs, outputs={"fit": "made_fit"}, params=params)
    assert f"{tmp_path}/{found}" in line
