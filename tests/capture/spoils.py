"""What people get wrong, done to the folder of a block."""

import shutil

import numpy as np
import pandas as pd
import yaml
from palpate.capture.images import write_image

KINECT = "kinect/08"


def change_csv(path, change):
    table = pd.read_csv(path)
    changed = change(table)
    (table if changed is None else changed).to_csv(path, index=False)


def drop_force(folder):
    (folder / KINECT / "force.csv").unlink()


def truncate_image(folder):
    path = folder / KINECT / "color/000003.png"
    path.write_bytes(path.read_bytes()[:1000])


def turn_time_back(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((4, "time_s"), 0.0))


def turn_force_time_back(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.loc.__setitem__((40, "time_s"), -9.0))


def spoil_force(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.loc.__setitem__((7, "v2"), np.nan))


def endless_force(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.loc.__setitem__((7, "v2"), np.inf))


def rename_sensor(folder):
    (folder / "kinect").rename(folder / "kinnect")


def rename_point(folder):
    (folder / "kinect/08").rename(folder / "kinect/99")


def lose_background(folder):
    shutil.rmtree(folder / "kinect/background")


def lose_image(folder):
    (folder / KINECT / "depth/000002.png").unlink()


def leave_folder(folder):
    change_csv(
        folder / KINECT / "frames.csv",
        lambda t: t.loc.__setitem__((2, "color"), "../../../../secret.png"),
    )


def lose_column(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.drop(columns="depth"))


def cut_force(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.iloc[:200])


def unknown_probe(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text().replace("nano25_sphere", "needle"))


def unknown_field(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text() + "colour: red\n")


def lose_object(folder):
    (folder / "object.yaml").unlink()


def lose_template(folder):
    (folder / "template.ply").unlink()


def bare_point(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text().replace("'01':", "01:"))


def flat_normal(folder):
    path = folder / "object.yaml"
    spec = yaml.safe_load(path.read_text())
    spec["support"]["plane_normal"] = [0, 0, 0]
    path.write_text(yaml.safe_dump(spec))


def endless_tolerance(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text().replace("tolerance_m: 0.001", "tolerance_m: .nan"))


def another_template(folder):
    (folder / "template.ply").write_text("solid block\n")


def unruly_name(folder):
    (folder / "kinect/08").rename(folder / "kinect/08-b")


def short_background(folder):
    change_csv(folder / "kinect/background/frames.csv", lambda t: t.iloc[:3])


def few_frames(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.iloc[:2])


def no_frames(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.iloc[:0])


def frame_twice(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((3, "frame"), 2))


def broken_frame(folder):
    change_csv(
        folder / KINECT / "frames.csv", lambda t: t.assign(frame=t["frame"] + 0.5 * (t.index == 1))
    )


def blank_image(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((2, "color"), None))


def few_forces(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.iloc[:5])


def lose_gauge(folder):
    change_csv(folder / KINECT / "force.csv", lambda t: t.drop(columns="v3"))


def word_in_force(folder):
    change_csv(
        folder / KINECT / "force.csv",
        lambda t: t.astype(object).where(~((t.index == 2)[:, None] & (t.columns == "v1")), "abc"),
    )


def small_image(folder):
    write_image(folder / KINECT / "color/000001.png", np.zeros((48, 64), np.uint8), "mono8")


def shallow_image(folder):
    write_image(folder / KINECT / "depth/000001.png", np.zeros((480, 640), np.uint8), "mono8")


def repeat_image(folder):
    images = folder / KINECT / "color"
    shutil.copy(images / "000004.png", images / "000005.png")


def name_image_twice(folder):
    change_csv(
        folder / KINECT / "frames.csv",
        lambda t: t.loc.__setitem__((5, "depth"), "depth/000004.png"),
    )


def name_an_endless_file(folder):
    change_csv(
        folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((2, "color"), "x" * 5000)
    )


def units_under_the_header(folder):
    path = folder / KINECT / "force.csv"
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, "s,V,V,V,V,V,V", *rows]) + "\n")


def times_of_day(folder):
    change_csv(
        folder / KINECT / "force.csv",
        lambda t: t.assign(time_s=[f"19:34:{s:09.6f}" for s in t["time_s"] + 1]),
    )


def link_image_to_itself(folder):
    path = folder / KINECT / "color/000002.png"
    path.unlink()
    path.symlink_to(path.name)


def link_image_elsewhere(folder):
    path = folder / KINECT / "color/000002.png"
    path.unlink()
    path.symlink_to("/etc/hostname")


def name_two_lines(folder):
    change_csv(folder / KINECT / "frames.csv", lambda t: t.loc.__setitem__((2, "color"), "a\nb"))


def template_of_another_kind(folder):
    path = folder / "object.yaml"
    path.write_text(path.read_text().replace("template.ply", "template.glb"))


def tiny_normal(folder):
    path = folder / "object.yaml"
    spec = yaml.safe_load(path.read_text())
    spec["points"]["08"]["direction"] = [0, 0, -1e-320]
    path.write_text(yaml.safe_dump(spec))


def point_in_millimetres(folder):
    path = folder / "object.yaml"
    spec = yaml.safe_load(path.read_text())
    spec["points"]["08"]["position_m"] = [-0.05, 0.0, 47.5]
    path.write_text(yaml.safe_dump(spec))
