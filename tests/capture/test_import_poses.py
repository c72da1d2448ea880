"""Poses of robots and trackers come in beside pictures and forces."""

import struct
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from bag_writing import COLOR_FRAME, NANOSECONDS, Messages, camera_messages, stand_in, write_bag
from import_help import assert_like, bring, read_spec, rejected, sqlite3
from palpate.__main__ import main
from palpate.capture.importing.pose_files import read_pose_file
from palpate.capture.poses import read_poses
from palpate.capture.tables import read_frames
from rosbags import rosbag2
from scipy.spatial.transform import RigidTransform, Rotation

TARGET, HERTZ = "raw/block/camera/08", 125
TF, POSE, JOINTS = "/tf", "/tracker/pose", "/joint_states"
KINDS = {
    TF: "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    POSE: "geometry_msgs/msg/PoseStamped",
    JOINTS: "sensor_msgs/msg/JointState",
}
CAMERA = RigidTransform.from_components((0.4, -0.1, 0.7), Rotation.from_rotvec((2.8, 0.1, 0.3)))
TOOL = RigidTransform.from_components((0.0, 0.02, 0.11), Rotation.from_rotvec((0, 0, 0.4)))
DEPTH = (COLOR_FRAME, "depth_optical", RigidTransform.identity())
STATIC = [("base", COLOR_FRAME, CAMERA), DEPTH, ("flange", "tool", TOOL)]


def moving(time_s):
    """A flange's pose in the base frame over time [s]."""
    time_s = np.atleast_1d(time_s)
    shift = np.stack([0.3 + 0.1 * time_s, 0.05 * time_s, 0.4 - 0.2 * time_s], axis=1)
    turn = Rotation.from_rotvec(time_s[:, None] * [0, 0.5, 0.1])
    return RigidTransform.from_components(shift, turn)


def encoded(topic, stamp_ns, transforms):
    """Bytes of CDR, of which nothing here is the import's: (frame, child, pose or 7 numbers)."""
    data = b"" if topic == POSE else struct.pack("<I", len(transforms))
    for *names, pose in transforms:
        data += bytes(-len(data) % 4) + struct.pack("<2I", *divmod(int(stamp_ns), NANOSECONDS))
        for name in names[:1] if topic == POSE else names:
            data += bytes(-len(data) % 4)
            data += struct.pack("<I", len(name) + 1) + name.encode() + b"\0"
        if isinstance(pose, RigidTransform):
            pose = np.concatenate([pose.translation.ravel(), pose.rotation.as_quat().ravel()])
        data += bytes(-len(data) % 8) + struct.pack("<7d", *pose)
    return b"\0\1\0\0" + data


def robot(path, film, sent):
    """A bag of ROS 2 with a film, and with what is sent at each time after its start [s]."""
    messages, start = Messages(ros1=False), film.wrench_ns[0]
    found = [one for one in camera_messages(film, messages) if one[0] != "/tf_static"]
    for topic, time_s, transforms in sent:
        stamp = int(start) + round(time_s * NANOSECONDS)
        data = encoded(topic, stamp, transforms) if topic != JOINTS else bytes(64)
        found.append((topic, stamp, SimpleNamespace(__msgtype__=KINDS[topic], data=data)))

    def serialise(message, name):
        own = isinstance(message, SimpleNamespace)
        return message.data if own else messages.store.serialize_cdr(message, name)

    folder = path / "film"
    write_bag(rosbag2.Writer(folder, version=9), found, messages.store, serialise)
    return folder


def stated(static=STATIC, hertz=HERTZ, pose=moving):
    """Static transforms, and the flange's over 0.48 s."""
    times = np.arange(0, 0.48, 1 / hertz)
    return [("/tf_static", 0.0, static), *((TF, t, [("base", "flange", pose(t))]) for t in times)]


@pytest.fixture
def film():
    """Pictures from 0.1 s on for 0.23 s, forces about them."""
    return stand_in(8)


def test_the_tools_pose_in_the_base_frame_by_transforms(film, tmp_path, capsys):
    bag = robot(tmp_path, film, stated())
    assert bring(bag, tmp_path / TARGET, "--tracked", "tool") == 0
    said = capsys.readouterr().out
    assert "poses: 60 of tool in base, the root of its tree (--base names another)" in said
    assert f"base: transforms say where {COLOR_FRAME} is in base" in said
    found = read_poses(tmp_path / TARGET)
    assert (found.base, found.tracked, len(found.time_s)) == ("base", "tool", 60)
    expected = (moving(found.time_s + 0.1) * TOOL).as_matrix()
    np.testing.assert_allclose(found.base_from_tracked, expected, rtol=0, atol=1e-6)
    spec, expected = read_spec(tmp_path), CAMERA.inv().as_matrix()
    assert spec["base"]["name"] == "base"
    np.testing.assert_allclose(spec["base"]["camera_from_base"], expected, atol=1e-8)
    # To a sensor's file without a base one is offered.
    del spec["base"]
    (tmp_path / "sensors/camera.yaml").write_text(yaml.safe_dump(spec))
    line = rejected(capsys, tmp_path, bag, "--tracked", "tool", target="raw/block/camera/09")
    assert_like("camera.yaml: base: expected where it is, like {camera_from_base: .*found", line)
    # Pictures that are to tell where it is need none.
    assert bring(bag, tmp_path / "raw/sensors/camera/hand_eye", "--tracked", "tool") == 0


def test_a_chain_is_interpolated_and_never_extrapolated(film, tmp_path, capsys):
    """A slide on the flange is stated at times of its own, and not so long."""
    slide = {t: moving(0.3 * t) for t in np.arange(0.05, 0.4, 0.021)}
    sent = [*stated(), *((TF, t, [("flange", "slide", pose)]) for t, pose in slide.items())]
    bag = robot(tmp_path, film, sent)
    assert bring(bag, tmp_path / TARGET, "--tracked", "slide", "--base", "base") == 0
    found = read_poses(tmp_path / TARGET)
    time_s = found.time_s + 0.1
    np.testing.assert_allclose(time_s[[0, -1]], [min(slide), max(slide)], atol=2e-6)
    inside = [t for t in np.arange(60) / HERTZ if min(slide) <= t <= max(slide)]
    assert len(time_s) == len({round(t, 6) for t in [*inside, *slide]})
    expected = (moving(time_s) * moving(0.3 * time_s)).as_matrix()
    np.testing.assert_allclose(found.base_from_tracked, expected, rtol=0, atol=1e-5)


def test_poses_of_a_topic_and_frames_that_they_do_not_cover(film, tmp_path, capsys):
    sent = [(POSE, 0.13 + k / 60, [("base", moving(k / 60))]) for k in range(20)]
    sent[3] = (POSE, 0.18, [("base", [np.nan] * 7)])
    bag = robot(tmp_path, film, [("/tf_static", 0.0, STATIC), *sent])
    assert bring(bag, tmp_path / TARGET, "--poses", POSE) == 0
    said = capsys.readouterr().out
    assert "poses: 1 of 20 lost or flagged by the tracker, left out" in said
    assert "frames: 1 before the first and 0 after the last pose, left out" in said
    assert len(read_frames(tmp_path / TARGET)) == 7
    assert len(read_poses(tmp_path / TARGET).time_s) == 19


BENT = [("base", "flange", [0, 0, 0, 0.5, 0.5, 0, 0])]
TREES = [("world", COLOR_FRAME, CAMERA), DEPTH]
OF_TOOL = "--poses /tf --tracked tool"
OTHER = [(POSE, k / 60, [("map", moving(k / 60))]) for k in range(9)]
GAP = [one for one in stated() if not 0.12 < one[1] < 0.31]
UNJOINED = "flange to world, found two trees: color_.*, world; and base, flange .record what"
BAGS = {
    "no frame named": (stated(), "--poses /tf", "--tracked: expected one of the frames base, "),
    "no such frame": (stated(), "--tracked gripper", "depth_optical, flange, tool, found gripper$"),
    "two trees": (stated(TREES), "--tracked flange --base world", UNJOINED),
    "it stands": (stated(pose=lambda _: moving(0.0)), OF_TOOL, "move tool in base, found fixed"),
    "a gap": (GAP, OF_TOOL, "expected poses at most 0.1 s apart, found none from"),
    "no quaternion": ([*stated(), (TF, 0.47, BENT)], OF_TOOL, "a unit quaternion.*length 0.707"),
    "joints": ([(JOINTS, 0.0, [])], "--tracked tool", "/joint_states .*no kinematics.*record /tf"),
    "another base": (OTHER, "--base base", "pose: frame_id: expected base .--base., found map"),
    "two topics": ([*stated(), *OTHER], "--base base", "named by --poses, found /tr.*, /tf"),
    "no base": (stated(TREES), "--tracked flange", "base: expected a sensor whose file places it"),
    "late": (stated(), f"{OF_TOOL} --poses-offset 3600", "during the frames' .*--poses-offset"),
}


@pytest.mark.parametrize("case", BAGS)
def test_bags_without_poses(case, film, tmp_path, capsys):
    sent, options, line = BAGS[case]
    film = stand_in(16, rate_hz=70) if case == "a gap" else film
    bag = robot(tmp_path, film, sent)
    assert_like(line, rejected(capsys, tmp_path, bag, *options.split()))


# Three poses, the second lost; at 0.02 s a step.
XYZW, PLACE_M = (0.8, 0.0, 0.0, 0.6), (0.01, 0.02, -0.03)
MM = "10,20,-30"
NDI = "Tools,Port 1,Frame,Face,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,Markers,State,Tx,Ty,Tz,Port 2,Frame"
NDI += ",Face,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error\n"
NDI += "".join(
    f"2,probe,{k},0,{pose},3,OK,7,8,9,ref,{k},0,OK,1,0,0,0,1,2,3,0.3\n"
    for k, pose in enumerate([f"OK,.6,.8,0,0,{MM},0.1", "MISSING" + 8 * ",", f"OK,.6,.8,0,0,{MM},"])
)
ROWS = "#ToolInfo,Frame#,Face#,TransformStatus,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error\n"
ROWS += f"probe,0,0,OK,.6,.8,0,0,{MM},0.1\nref,0,0,OK,1,0,0,0,{MM},0.1\n"
ROWS += f"probe,1,0,Missing,,,,,,,,\nprobe,2,0,OK,.6,.8,0,0,{MM},\n"
MOTIVE = "Format Version,1.23,Take Name,t,Rotation Type,Quaternion,Length Units,Millimeters\n\n"
MOTIVE += f",,Marker,{','.join(8 * ['Rigid Body'])}\n,,m,{','.join(8 * ['probe'])}\n"
MOTIVE += ",,1,2,2,2,2,2,2,2,2\n,,Position,Rotation,Rotation,Rotation,Rotation,Position,Position,"
MOTIVE += "Position,Mean Marker Error\nFrame,Time (Seconds),X,X,Y,Z,W,X,Y,Z,\n"
MOTIVE += f"0,0.00,5,.8,0,0,.6,{MM},0.1\n1,0.02,5,,,,,,,,\n2,0.04,5,.8,0,0,.6,{MM},0\n"
VICON = "Objects\n50\n,,Global Angle (Quaternion) probe:probe,,,,,,,Global Angle (Quaternion) a:a\n"
VICON += "Frame,Sub Frame,RX,RY,RZ,RW,TX,TY,TZ,RX,RY,RZ,RW,TX,TY,TZ\n,,,,,,mm,mm,mm,,,,,mm,mm,mm\n"
VICON += f"0,0,.8,0,0,.6,{MM},0,0,0,1,0,0,0\n1,0,0,0,0,0,0,0,0,0,0,0,1,0,0,0\n"
VICON += f"2,0,.8,0,0,.6,{MM},0,0,0,1,0,0,0\n\nTrajectories\n50\n"
HELICAL = "Segments\n50\n,,Body:probe\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,deg,deg,deg,mm,mm,mm\n"
DEGREES = np.degrees(2 * np.arctan2(0.8, 0.6))
HELICAL += f"0,0,{DEGREES},0,0,{MM}\n1,0,,,,,,\n2,0,{DEGREES},0,0,{MM}\n"
TUM = "# timestamp tx ty tz qx qy qz qw\n"
TUM += "".join(f"{t} 0.01 0.02 -0.03 0.8 0 0 0.6\n" for t in (0, 0.04))
OWN = "time_s,qw,qx,qy,qz,x_m,y_m,z_m,std_m,valid,base,tracked\n"
OWN += "0,.6,.8,0,0,.01,.02,-.03,1e-4,1,b,probe\n0.02,.6,.8,0,0,.01,.02,-.03,1e-4,0,b,probe\n"
OWN += "0.04,.6,.8,0,0,.01,.02,-.03,,1,b,probe\n"
FILES = {"ndi": NDI.replace(",", "\t"), "rows of ndi": ROWS, "motive": MOTIVE, "vicon": VICON}
FILES |= {"helical": HELICAL, "tum": TUM, "own": OWN}
WITH_ERRORS = ("ndi", "rows of ndi", "motive", "own")


def read(tmp_path, text, **asked):
    (tmp_path / "poses.txt").write_text(text)
    nothing = {"base": None, "tracked": None, "poses_rate_hz": 50}
    return read_pose_file(tmp_path / "poses.txt", SimpleNamespace(**nothing | asked)).record


@pytest.mark.parametrize("name", FILES)
def test_files_of_trackers(name, tmp_path):
    found = read(tmp_path, FILES[name], tracked="probe")
    np.testing.assert_allclose(found.time_s, [0, 0.04], atol=1e-12)
    expected = RigidTransform.from_components(PLACE_M, Rotation.from_quat(XYZW)).as_matrix()
    np.testing.assert_allclose(found.base_from_tracked, [expected, expected], atol=1e-12)
    expected = [1e-4, np.nan] if name in WITH_ERRORS else [np.nan, np.nan]
    np.testing.assert_allclose(found.std_m, expected)
    assert (found.base, found.tracked) == ("b" if name == "own" else "", "probe")


@pytest.mark.parametrize(
    ("text", "asked", "line"),
    [
        (NDI, {}, "poses.txt: tools: expected one, named by --tracked, found probe, ref"),
        (ROWS, {"tracked": "pen"}, r"tools: expected pen \(--tracked\), found probe, ref"),
        (NDI, {"tracked": "ref", "poses_rate_hz": None}, "time: expected .* --poses-rate .*frames"),
        (ROWS.replace(".6", "6"), {"tracked": "probe"}, "a unit quaternion .*, found length 6"),
        (MOTIVE.replace("Quaternion", "XYZ"), {}, "Rotation Type: expected Quaternion .*found XYZ"),
        (MOTIVE.replace("Length", "No"), {}, "unit: expected mm or cm or m .*, found none named"),
        (HELICAL.replace("mm", ""), {}, "unit: expected mm or cm or m .in the row below .* none"),
        (HELICAL.replace("deg", ""), {}, "unit: expected deg or rad .*, found none named"),
        (VICON.replace("Quaternion", "Euler"), {}, "angles: expected quaternions or helical"),
        (TUM.replace("0.6", "much"), {}, "poses.txt: file: expected probe_poses.csv, an export of"),
        (OWN.replace("0.04", "soon"), {}, "pose 3: expected numbers, or nothing, found soon"),
        (OWN, {"base": "world"}, r"base: expected world \(--base\), found b"),
        (OWN.replace(",1,b", ",0,b"), {}, "poses: expected at least 2 that were not lost, found 0"),
    ],
)
def test_files_without_poses(text, asked, line, tmp_path):
    with pytest.raises(ValueError, match=line):
        read(tmp_path, text, **asked)


def test_a_trackers_file_beside_a_recording(film, tmp_path):
    """The probe's file names the tool, the sensor's the base, and an offset mends the clock."""
    assert bring(sqlite3(tmp_path, film), tmp_path / TARGET) == 0
    spec = read_spec(tmp_path) | {"base": {"name": "b", "camera_from_base": np.eye(4).tolist()}}
    (tmp_path / "sensors/camera.yaml").write_text(yaml.safe_dump(spec))
    times = film.wrench_ns[0] / NANOSECONDS + np.arange(0, 0.5, 0.02)
    lines = [f"{t - 3600:.6f} {t % 1:.6f} 0 0 0 0 0 1" for t in times]
    (tmp_path / "poses.txt").write_text("\n".join(lines))
    (tmp_path / "raw/block/object.yaml").write_text("probe: pen\n")
    (tmp_path / "config/probes").mkdir(parents=True)
    (tmp_path / "config/probes/pen.yaml").write_text("tracked: probe\n")
    options = ["--poses", str(tmp_path / "poses.txt"), "--poses-offset", "3600"]
    assert bring(tmp_path / "film", tmp_path / "raw/block/camera/09", *options) == 0
    found = read_poses(tmp_path / "raw/block/camera/09")
    assert (found.base, found.tracked) == ("b", "probe")
    np.testing.assert_allclose(found.time_s, times - film.color_ns[0] / NANOSECONDS, atol=1e-5)


def test_files_begun_by_the_command_are_filled_in_by_the_imports(film, tmp_path, monkeypatch):
    """Background first: where the base is, an indentation's transforms say."""
    for name in ("config", "empty", "press"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path)
    empty = robot(tmp_path / "empty", film, [("/tf_static", 0.0, STATIC)])
    press = robot(tmp_path / "press", film, stated())
    assert main(["new", "block", "--sensor", "arm_cam", "--board", "none"]) == 0
    sensor = tmp_path / "config/sensors/arm_cam.yaml"
    begun = sensor.read_text()
    sensor.write_text("3")
    assert main(["import", str(empty), "raw/block/arm_cam", "--background"]) == 1
    sensor.write_text(begun)
    assert main(["import", str(empty), "raw/block/arm_cam", "--background"]) == 0
    probe = tmp_path / "config/probes/probe.yaml"
    assert main(["import", str(press), "raw/block/arm_cam/01"]) == 1
    probe.write_text(probe.read_text().replace("tracked: FILL_IN", "tracked: tool"))
    assert main(["import", str(press), "raw/block/arm_cam/01"]) == 0
    spec, expected = yaml.safe_load(sensor.read_text()), CAMERA.inv().as_matrix()
    assert spec["color"]["encoding"] == "rgb8" and spec["base"]["name"] == "base"
    np.testing.assert_allclose(spec["base"]["camera_from_base"], expected, atol=1e-8)
    assert "marker" not in spec
