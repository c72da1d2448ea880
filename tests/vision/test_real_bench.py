"""What stands about and moves on a real bench, as the lab draws it."""

import numpy as np
import pytest
import trimesh
from palpate.vision.camera import PinholeCamera
from palpate.vision.clouds import ProbePlace, Reach, object_cloud
from palpate.vision.options import Clouds
from virtual_lab.part import OBJECT, PROBE_PARTS
from virtual_lab.probe import make_probe
from virtual_lab.render import View, look_at
from virtual_lab.scene import Bench, Scene
from virtual_lab.texture import table_texture

SIZE = np.array([0.12, 0.10, 0.05])
TIP = np.array([0.0, 0.0, SIZE[2] + 0.00622])
TURN = np.column_stack([[1, 0, 0], [0, -1, 0], [0, 0, -1.0]])
CAMERA = PinholeCamera(320, 240, 280.0, 280.0, 159.5, 119.5)
VIEW = View(CAMERA, look_at([0, 0, 0.05], distance_m=0.65, elevation_deg=45))


@pytest.fixture(scope="module")
def bench():
    return Bench(table_texture(np.random.default_rng(0)), None)


def seen(scene):
    """Points in the camera's frame [m] and what each is, in the order of the pixels."""
    origin, directions = VIEW.rays(CAMERA.pixel_grid())
    hits = scene.cast(origin, directions)
    kind = np.where(np.isfinite(hits["t"]), hits["kind"], -1)
    points = origin + np.where(kind < 0, 0, hits["t"])[:, None] * directions
    return moved(points), kind


def moved(points):
    """From the object's frame to the camera's."""
    transform = VIEW.camera_from_object
    return points @ transform[:3, :3].T + transform[:3, 3]


@pytest.mark.parametrize(
    ("elbow_m", "size_m"),
    [((0.35, 0.20, -0.05), SIZE), ((0.12, 0.05, 0.02), SIZE), ((-0.30, 0.05, 0.0), SIZE / 2)],
    ids=["beside", "joined", "small"],
)
def test_the_operators_forearm_is_not_the_object(bench, probe, elbow_m, size_m):
    """Beside the object, nearly on it, and before a small one."""
    box = trimesh.creation.box(size_m)
    box.apply_translation([0, 0, size_m[2] / 2])
    tip = TIP - [0, 0, SIZE[2] - size_m[2]]
    scene = Scene(
        bench,
        surface_m=np.asarray(box.vertices),
        faces=np.asarray(box.faces),
        probe=make_probe(probe, elbow_m),
        tip_m=tip,
        object_from_force=TURN,
    )
    points, kind = seen(scene)
    up = VIEW.camera_from_object[:3, 2]
    plane = np.append(up, -up @ VIEW.camera_from_object[:3, 3])
    board = TURN @ (make_probe(probe).tip_from_marker @ [0.03, 0.02, 0, 1])[:3] + tip
    place = ProbePlace(moved(tip), -up, moved(board))
    arguments = plane, place, probe["exclusion"]
    mask = np.isin(kind, [OBJECT, *PROBE_PARTS]).reshape(240, 320)
    reach = Reach(moved(tip), np.linalg.norm(size_m[:2] / 2), size_m[2])
    cloud = object_cloud(points, mask, CAMERA, *arguments, reach, **Clouds().written())
    alone = object_cloud(
        points, (kind == OBJECT).reshape(240, 320), CAMERA, *arguments, reach, **Clouds().written()
    )
    inside = np.abs(cloud.points_m[:, None] - alone.points_m).max(axis=2).min(axis=1) < 0.003
    assert inside.mean() > 0.99
    assert len(cloud.points_m) > 0.95 * len(alone.points_m)
