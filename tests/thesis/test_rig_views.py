"""Figures 4.1, 4.5 and 4.7: parts and poses are those of the configuration."""

import numpy as np
import pytest
import yaml
from palpate.report import style
from thesis.chapter4 import probe_view, rig_parts, rig_views, sensor_views

PLACEMENT = {"target_m": [0.0, 0.0, 0.09], "distance_m": 0.65, "elevation_deg": 45}


@pytest.fixture(scope="module")
def lab(root):
    return yaml.safe_load((root / "config/lab.yaml").read_text())


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    for module, name in ((rig_views, "PIXELS_PER_MM"), (probe_view, "PIXELS_PER_MM")):
        monkeypatch.setattr(module, name, 0.1)
    monkeypatch.setattr(sensor_views, "WIDTH_PX", 40)


def setup(sensor, probe, placement=PLACEMENT):
    return {
        "sensor": sensor,
        "probe": probe,
        "size_m": [0.598, 0.15, 0.0475],
        "point_m": [0.05, 0.0, 0.0475],
        "placement": placement,
    }


def texts(figure):
    return " ".join(text.get_text() for text in figure.findobj(style.matplotlib.text.Text))


def test_camera_stands_at_its_distance_and_looks_at_its_target():
    pose = rig_views.camera_pose(PLACEMENT)
    assert pose[:3, :3].T @ pose[:3, :3] == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    ahead = np.array(PLACEMENT["target_m"]) - pose[:3, 3]
    assert ahead == pytest.approx(0.65 * pose[:3, 2])
    assert pose[2, 3] == pytest.approx(0.09 + 0.65 * np.sin(np.pi / 4))
    assert pose[1, 3] < 0


def test_field_of_view_ends_on_the_table_or_at_its_reach(sensors):
    pose = rig_views.camera_pose(PLACEMENT)
    corners = rig_views.frustum(sensors["bumblebee"]["color"], pose, 0.7)
    assert corners[0] == pytest.approx(pose[:3, 3])
    assert corners[3:, 2] == pytest.approx(0, abs=1e-12)
    assert (corners[1:3] - pose[:3, 3]) @ pose[:3, 2] == pytest.approx(0.7)


def test_optics_stand_a_baseline_apart(sensors):
    _, places = rig_parts.stereo_shape(sensors["bumblebee"])
    gap = places["right camera"] - places["left camera"]
    assert gap == pytest.approx([0.12, 0, 0])
    _, places = rig_parts.structured_shape(sensors["kinect"])
    gap = places["infrared projector"] - places["infrared camera"]
    assert np.linalg.norm(gap) == pytest.approx(0.075, rel=1e-6)
    assert places["infrared camera"][0] < 0 < places["infrared projector"][0]


def test_sphere_touches_the_pressed_point(probe):
    vertices = rig_views.probe_on(probe, [0.05, 0.0, 0.0475]).vertices_m
    lowest = vertices[vertices[:, 2].argmin()]
    assert lowest == pytest.approx([0.05, 0, 0.0475], abs=1e-6)


def test_board_faces_the_cameras_and_leans_as_configured(probe):
    face = -np.linalg.inv(probe["marker_from_force"])[:3, 2]
    towards = rig_views.UPRIGHT @ face
    assert towards[1] < 0 < towards[2]
    assert probe_view.lean_deg(probe) == pytest.approx(20, abs=1e-3)
    ends = probe_view._board_ends(probe, probe_view.side_view(probe))
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(80)


def test_field_of_view_of_a_right_angle():
    camera = {"width_px": 200, "fx_px": 100.0, "cx_px": 100.0}
    camera |= {"height_px": 100, "fy_px": 100.0, "cy_px": 0.0}
    assert sensor_views.field_deg(camera) == pytest.approx((90, 45))


def test_figures_name_the_configured_numbers(sensors, probe, lab):
    block = lab["objects"]["foam_block"]
    scan = block["scan"] | {"size_m": block["shape"]["size_m"]}
    placed = [{"sensor": sensors[k], "distance_m": 0.65} for k in ("bumblebee", "kinect")]
    with style.journal():
        devices = texts(sensor_views.figure_4_1(*placed, scan))
        parts = texts(probe_view.figure_4_5(probe))
        shown = [setup(sensors[k], probe) for k in ("bumblebee", "kinect")]
        setups = texts(rig_views.figure_4_7(shown, provenance="simulated"))
    for words in ("baseline 120 mm", "baseline 75 mm", "VIVID 910", "16 views of 1.5 m"):
        assert words in devices
    for words in ("radius 6.22 mm", "60 mm to", "leans 20°", "5 × 4 squares of 20 mm"):
        assert words in parts
    for words in ("Bumblebee2", "Kinect", "0.65 m", "45° down", "598 mm", "simulated captures"):
        assert words in setups
    style.plt.close("all")


def test_no_setup_and_no_shape():
    with pytest.raises(ValueError, match="setups: expected at least one sensor, found none"):
        rig_views.figure_4_7([], provenance="simulated")
    with pytest.raises(ValueError, match="shapes: expected at least one, found none"):
        rig_parts.joined([])


def test_bytes_are_the_same_each_time(probe, tmp_path):
    for k in "ab":
        with style.journal():
            figure = probe_view.figure_4_5(probe)
            style.save(figure, tmp_path / f"{k}.png", tmp_path / f"{k}.svg")
    for ending in ("png", "svg"):
        one, other = ((tmp_path / f"{k}.{ending}").read_bytes() for k in "ab")
        assert one == other
