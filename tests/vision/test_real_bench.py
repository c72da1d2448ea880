"""What stands about and moves on a real bench, as the lab draws it."""

import numpy as np
import pandas as pd
import pytest
import trimesh
from palpate.capture.images import write_image
from palpate.capture.tables import write_frames
from palpate.vision.camera import PinholeCamera
from palpate.vision.clouds import Cloud, ProbePlace, Reach, in_mask, object_cloud, table_of
from palpate.vision.options import Clouds, SupportPlane
from palpate.vision.support_plane import fit_support_plane
from virtual_lab.paint import table_texture
from virtual_lab.probe import OBJECT, PROBE_PARTS, PROP, Part, make_probe
from virtual_lab.render import PosedCamera, look_at
from virtual_lab.scene import NO_FINISH, Bench, Scene

SIZE = np.array([0.12, 0.10, 0.05])
TIP = np.array([0.0, 0.0, SIZE[2] + 0.00622])
NO_SHEET = np.zeros((4, 3))
TURN = np.column_stack([[1, 0, 0], [0, -1, 0], [0, 0, -1.0]])
CAMERA = PinholeCamera(320, 240, 280.0, 280.0, 159.5, 119.5)
VIEW = PosedCamera(CAMERA, look_at([0, 0, 0.05], distance_m=0.65, elevation_deg=45))


@pytest.fixture(scope="module")
def bench():
    return Bench(table_texture(np.random.default_rng(0)), None)


def seen(scene, view=VIEW):
    """Points in the camera's frame [m] and what each is, in the order of the pixels."""
    origin, directions = view.rays(CAMERA.pixel_grid())
    hits = scene.cast(origin, directions)
    kind = np.where(np.isfinite(hits["t"]), hits["kind"], -1)
    points = origin + np.where(kind < 0, 0, hits["t"])[:, None] * directions
    return moved(points, view), kind


def moved(points, view=VIEW):
    """From the object's frame to the camera's."""
    transform = view.camera_from_object
    return points @ transform[:3, :3].T + transform[:3, 3]


def box_on_table(bench, size_m, **more):
    """Scene of a box, its points and kinds as `seen` gives them, and the table's plane."""
    box = trimesh.creation.box(size_m)
    box.apply_translation([0, 0, size_m[2] / 2])
    vertices, faces = np.asarray(box.vertices), np.asarray(box.faces)
    points, kind = seen(Scene(bench, surface_m=vertices, faces=faces, **more))
    up = VIEW.camera_from_object[:3, 2]
    return points, kind, np.append(up, -up @ VIEW.camera_from_object[:3, 3])


def shown(points, mask):
    """Those points that the camera sees in a mask."""
    return Cloud(points[in_mask(points, mask.reshape(240, 320), CAMERA)])


@pytest.mark.parametrize(
    ("elbow_m", "size_m"),
    [((0.35, 0.20, -0.05), SIZE), ((0.12, 0.05, 0.02), SIZE), ((-0.30, 0.05, 0.0), SIZE / 2)],
    ids=["beside", "joined", "small"],
)
def test_the_operators_forearm_is_not_the_object(bench, probe, elbow_m, size_m):
    """Beside the object, nearly on it, and before a small one."""
    tip = TIP - [0, 0, SIZE[2] - size_m[2]]
    arm = {"probe": make_probe(probe, elbow_m), "tip_m": tip, "object_from_force": TURN}
    points, kind, plane = box_on_table(bench, size_m, **arm)
    board = TURN @ (make_probe(probe).tip_from_marker @ [0.03, 0.02, 0, 1])[:3] + tip
    place = ProbePlace(moved(tip), -plane[:3], moved(board), NO_SHEET, probe["exclusion"])
    reach = Reach(moved(tip), np.linalg.norm(size_m[:2] / 2), size_m[2], plane)
    cloud, alone = (
        object_cloud(shown(points, mask), place, reach, Clouds())
        for mask in (np.isin(kind, [OBJECT, *PROBE_PARTS]), kind == OBJECT)
    )
    inside = np.abs(cloud.points_m[:, None] - alone.points_m).max(axis=2).min(axis=1) < 0.003
    assert inside.mean() > 0.99
    assert len(cloud.points_m) > 0.95 * len(alone.points_m)


def test_an_object_longer_than_its_template_is_no_such_object(bench, probe):
    """Cut to the template's reach, a bar of 40 cm would pass for one of 12."""
    points, kind, plane = box_on_table(bench, [0.4, 0.10, 0.05])
    place = ProbePlace(
        moved(TIP), -plane[:3], moved(TIP + [0, 0, 0.1]), NO_SHEET, probe["exclusion"]
    )
    arguments = shown(points, kind == OBJECT), place
    whole = Reach(moved(TIP), 0.21, SIZE[2], plane)
    assert len(object_cloud(*arguments, whole, Clouds()).points_m) > 1000
    short = whole._replace(beside_m=np.linalg.norm(SIZE[:2] / 2))
    with pytest.raises(ValueError, match=r"to end 0.10 m beside the tip, .* of its foot beyond"):
        object_cloud(*arguments, short, Clouds())


def flat(corners):
    return Part(PROP, np.array(corners, dtype=float), np.array([[0, 1, 2], [0, 2, 3]]), NO_FINISH)


def level(half_x, half_y, z, x=0.0):
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [half_x, half_y] + [x, 0]
    return flat(np.column_stack([corners, np.full(4, z)]))


def upright(half_x, height, y):
    return flat([[-half_x, y, -1], [half_x, y, -1], [half_x, y, height], [-half_x, y, height]])


ROOMS = {
    "plain": [level(0.6, 0.6, 0)],
    "floor": [level(0.18, 0.12, 0), level(3, 3, -0.3)],
    "wall": [level(0.6, 0.12, 0), upright(3, 2, 0.12)],
    "side": [level(0.2, 0.6, 0), flat([[0.2, -3, -1], [0.2, 3, -1], [0.2, 3, 2], [0.2, -3, 2]])],
    "book": [level(0.6, 0.6, 0), level(0.10, 0.12, 0.03, x=0.22)],
}


def check_table(parts, elevation_deg, turn=1):
    """Find the table in a noisy cloud of parts, the right way up or upside down."""
    view = PosedCamera(CAMERA, look_at([0, 0, 0.05], distance_m=0.65, elevation_deg=elevation_deg))
    points, kind = seen(Scene(Bench(None, None, parts)), view)
    points = points[kind == PROP]
    noisy = points * (1 + np.random.default_rng(1).normal(0, 0.002, (len(points), 1)))
    turned, rng = noisy * [turn, turn, 1], np.random.default_rng(0)
    plane = fit_support_plane(turned, inlier_distance_m=0.004, rng=rng)
    up = view.camera_from_object[:3, 2] * [turn, turn, 1]
    assert np.rad2deg(np.arccos(min(plane[:3] @ up, 1))) < 0.5
    assert abs(plane[:3] @ (view.camera_from_object[:3, 3] * [turn, turn, 1]) + plane[3]) < 0.002


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("elevation_deg", [25, 45, 70])
def test_the_table_is_what_carries_the_object(room, elevation_deg):
    """A wall or a floor behind a small table has more points, a book on it is nearer."""
    check_table(ROOMS[room], elevation_deg)


@pytest.mark.parametrize("elevation_deg", [30, 45, 80])
def test_a_camera_that_hangs_upside_down_sees_the_same_table(elevation_deg):
    """A wall at the picture's edge is level to it, and has a tenth of the points."""
    check_table([level(0.6, 0.4, 0), upright(0.6, 0.1, 0.25)], elevation_deg, turn=-1)


def test_the_table_is_that_of_all_frames(sensors, tmp_path):
    """In the first a sheet is carried away over it."""
    sensor = dict(sensors["kinect"], depth=dict(sensors["kinect"]["depth"], encoding="millimetre"))
    spec = sensor["depth"] | {"color_from_depth": np.eye(4)}
    spec |= {"fx_px": 280.0, "fy_px": 280.0, "cx_px": 159.5, "cy_px": 119.5}
    (tmp_path / "depth").mkdir()
    write_image(tmp_path / "color.png", np.zeros((4, 4), np.uint8), "bayer_rggb8")
    rng = np.random.default_rng(2)
    for k, parts in enumerate([[level(0.6, 0.6, 0.2)], *[[level(0.6, 0.6, 0)]] * 3]):
        points, kind = seen(Scene(Bench(None, None, parts)))
        depth_m = np.where(kind == PROP, points[:, 2] + rng.normal(0, 0.002, len(points)), 0)
        image = np.round(1000 * depth_m).astype(np.uint16).reshape(240, 320)
        write_image(tmp_path / f"depth/{k}.png", image, "millimetre")
    rows = {"frame": range(4), "time_s": range(4)}
    names = [f"depth/{k}.png" for k in range(4)]
    write_frames(tmp_path, pd.DataFrame(rows | {"color": "color.png", "depth": names}))
    size = {"width_px": 320, "height_px": 240, "distortion": [0] * 5}
    plane = table_of(tmp_path, sensor | {"depth": spec | size}, SupportPlane(), seed=1)
    assert abs(plane[:3] @ VIEW.camera_from_object[:3, 3] + plane[3]) < 0.002
