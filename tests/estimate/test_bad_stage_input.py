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


# Depth [mm] and force [N] of each sample, whether there is a baseline, and what is said.
UNUSABLE = [
    ([-1, 1], [0, 1], False, "force.csv: depth: expected at least 2 samples in contact, found 1"),
    ([-1, 1, 2], [0, 1, 2], True, "force.csv: samples: expected more than 3, found 3"),
    (
        *([-20, -17.5, -15, -12.5, -10], [0, 0.5, 1, 1.5, 2], False),
        f"probe_pose.csv: {FAR} 17.5 mm above in frame 1",
    ),
    ([-20, 7, 8], [0, 1, 2], False, f"probe_pose.csv: {FAR} 7.0 mm below in frame 1"),
    ([-1, 1], [0, 0.05], False, "force.csv: force: expected above 0.1 N, found at most 0.05"),
    ([-1, 1], [0.5, 0.9], False, "force.csv: force: expected samples before contact"),
]


@pytest.mark.parametrize(("depths_mm", "newtons", "baseline", "found"), UNUSABLE)
def test_what_a_hertz_stage_cannot_use_is_one_line(
    stage, root, tmp_path, depths_mm, newtons, baseline, found
):
    """Of an indentation into the top of a box."""
    box = trimesh.creation.box((SIZE, SIZE, SIZE)).subdivide()
    box.apply_translation([SIZE / 2] * 3).export(tmp_path / "template.ply")
    save_alignment(tmp_path / "alignment.json", Alignment(np.eye(4), TOP, 1, 1e-4))
    tips = TOP + [0, 0, RADIUS] - np.outer(depths_mm, [0, 0, 1e-3])
    poses = dict(zip(("tip_x_m", "tip_y_m", "tip_z_m"), tips.T, strict=True))
    table = pd.DataFrame(poses | {"raw_tip_std_along_m": 0 * tips[:, 0]})
    write_table(tmp_path / "probe_pose.csv", table)
    forces = {"time_s": np.arange(len(newtons)) / 6, "fx_n": 0.0, "fy_n": 0.0}
    write_table(tmp_path / "force.csv", pd.DataFrame(forces | {"fz_n": -np.array(newtons)}))
    (tmp_path / "clock.json").write_text('{"std_s": 0.02}')
    content = {"template": {"unit": "m", "vertices": 50}, "support": SUPPORT}
    content |= {"points": {"01": {"position_m": TOP.tolist()}}}
    (tmp_path / "object.yaml").write_text(yaml.safe_dump(content))
    files = "object.yaml template.ply alignment.json probe_pose.csv force.csv clock.json".split()
    names = "object template alignment pose force clock".split()
    inputs = {name: tmp_path / file for name, file in zip(names, files, strict=True)}
    config = full(root)
    params = {"options": config["hertz"] | {"baseline": baseline}, "probe": PROBE}
    params["rig"] = config["direct"]["fit"]["rig"]
    line = stage("hertz", inputs=inputs, outputs={"fit": "made_fit"}, params=params)
    assert f"{tmp_path}/{found}" in line
