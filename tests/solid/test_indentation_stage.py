"""The script that makes an indentation table: from an object's files to the table, or one line."""

import numpy as np
import pytest
import trimesh
import yaml
from palpate.estimate.direct.table import force_table
from palpate.solid.indentation_table import load_indentation
from palpate.solid.mesh import solid_mesh, write_solid
from settings import full
from skfem import MeshTet

SIZE, RADIUS = 0.1, 0.02
TOP = [0.05, 0.05, 0.1]


@pytest.fixture
def press(root, stage, tmp_path):
    """Run the script for a cube."""
    box = trimesh.creation.box((SIZE, SIZE, SIZE)).apply_translation([SIZE / 2] * 3)
    box.export(tmp_path / "template.ply")
    cube = MeshTet().refined(2)
    write_solid(tmp_path / "solid.vtu", solid_mesh(SIZE * cube.p.T, cube.t.T))
    config = full(root)["direct"]["model"]
    coarse = {"edge_m": 0.012, "growth": 1.0, "refine_radius_m": 0.03, "step_m": 0.001}
    few = {"poisson_ratios": [0.2, 0.3], "deepest_m": 0.002}

    def run(point="01", support=None, **options):
        plane = {"plane_point_m": [0, 0, 0], "plane_normal": [0, 0, 1], "tolerance_m": 0.001}
        content = {
            "template": {"unit": "m"},
            "support": plane | (support or {}),
            "points": {"01": {"position_m": TOP}, "02": {"position_m": [0.05, 0.05, 0.12]}},
        }
        (tmp_path / "object.yaml").write_text(yaml.safe_dump(content))
        names = {"object": "object.yaml", "template": "template.ply", "solid": "solid.vtu"}
        return stage(
            "indentation",
            inputs={name: tmp_path / file for name, file in names.items()} | {"image": None},
            outputs={"model": "model.npz"},
            params={
                "mirrors": [],
                "probe": {"indenter": {"radius_m": RADIUS}},
                "options": config | coarse | few | options,
            },
            wildcards={"object": "cube", "point": point},
        )

    return run


def test_table_of_a_cube(press, tmp_path):
    assert press() is None
    model = load_indentation(tmp_path / "model.npz")
    assert model.laws == ("neo_hookean", "blatz_ko")
    assert model.depth_m[-1] == pytest.approx(0.002)
    assert model.point_m == pytest.approx(TOP, abs=1e-6)
    hertz = 4 / 3 / (1 - 0.25**2) * np.sqrt(RADIUS) * 0.002**1.5
    assert 0.8 < force_table(model).force(0.002, 0.25, law=1) / hertz < 1.4
    log = (tmp_path / "log.txt").read_text()
    assert "blatz_ko, Poisson's ratio 0.3:" in log


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"point": "07"}, "object.yaml: points: expected one of 01, 02, found 07"),
        ({"point": "02"}, "object.yaml: point_m: expected within 0.005 m of the surface"),
        ({"deepest_m": 0.15}, "object.yaml: deepest_m: expected above 0 and below the thickness"),
        ({"support": {"plane_normal": [0, 0, 0]}}, "object.yaml: support.plane_normal: expected"),
    ],
)
def test_bad_input(press, change, message):
    assert message in press(**change)
