"""Poses out of bags: the way from frame to frame by /tf and /tf_static, and PoseStamped."""

from array import array
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.capture.importing.bags import TRANSFORMS, Bag, chosen, held, open_bag, stamp_ns
from palpate.capture.importing.optics import rows
from palpate.capture.importing.pose_files import Poses, pose_record, rigid
from palpate.capture.importing.recording import NANOSECONDS, Request, named, shown
from palpate.capture.poses import LARGEST_GAP_S, PoseRecord
from palpate.yaml_files import mismatch

STATIC = "tf_static"
POSE_STAMPED, JOINTS = "geometry_msgs/msg/PoseStamped", "sensor_msgs/msg/JointState"
# What varies by less is fixed: old ROS publishes fixed transforms over and over [m, 1].
FIXED = 1e-9
MOST_SHOWN = 40


class Tree:
    """Frames of a bag, joined by transforms on /tf_static and, if they count, on other topics."""

    def __init__(self, bag: Bag, *, moving: bool = True) -> None:
        topics = [name for name in bag.topics(TRANSFORMS) if moving or name.endswith(STATIC)]
        self._stated, self._fixed = defaultdict(lambda: (array("q"), array("d"))), set()
        self.beside: dict[str, set[str]] = defaultdict(set)
        for topic, _, message in bag.messages(topics):
            for one in message.transforms:
                key = parent, child = plain(one.header.frame_id), plain(one.child_frame_id)
                times_ns, values = self._stated[key]
                times_ns.append(stamp_ns(one, 0))
                values.extend(parts(one.transform.rotation, one.transform.translation))
                self.beside[parent].add(child)
                self.beside[child].add(parent)
                self._fixed |= {key} if topic.endswith(STATIC) else set()
        self.start_ns = min((min(times_ns) for times_ns, _ in self._stated.values()), default=0)

    def __contains__(self, frame: str | None) -> bool:
        return frame in self.beside

    def root(self, frame: str) -> str:
        """The frame above all others from which one is reached."""
        parents = {child: parent for parent, child in self._stated}
        for _ in parents:
            frame = parents.get(frame, frame)
        return frame

    def joined(self, start: str) -> dict[str, str]:
        """Frames that transforms join to one, each with its neighbour on the way there."""
        towards, waiting = {start: start}, [start]
        for here in waiting:
            for there in sorted(self.beside.get(here, set()) - towards.keys()):
                towards[there] = here
                waiting.append(there)
        return towards

    def path(self, target: str, source: str, remedy: str) -> tuple[NDArray, NDArray]:
        """target_from_source where all transforms on the way are known, none extrapolated.

        Returns
        -------
        time_s : (n,) array
            Stamps of all transforms that move, from ``start_ns`` on [s]; empty if none does.
        transforms : (n, 4, 4) array
            Interpolated by straight lines and SLERP; (1, 4, 4) if none moves.

        Raises
        ------
        ValueError
            If no transforms join the frames (``remedy`` says what helps), or one is none.
        """
        target, source = plain(target), plain(source)
        towards = self.joined(target)
        if source not in towards:
            found = f"two trees: {listed(towards)}; and {listed(self.joined(source))} ({remedy})"
            raise mismatch("frames", f"a path from frame {source} to {target}", found)
        steps = []
        while source != target:
            steps.insert(0, (towards[source], source))
            source = towards[source]
        records = [self._record(*step) for step in steps]
        moving = [record for record in records if len(record.time_s) > 1]
        time_s = np.unique(np.concatenate([np.zeros(0), *(record.time_s for record in moving)]))
        for record in moving:
            time_s = time_s[(time_s >= record.time_s[0]) & (time_s <= record.time_s[-1])]
        if moving and not len(time_s):
            raise mismatch("frames", f"transforms to {target} that overlap in time", "none")
        product = np.tile(np.eye(4), (len(time_s) if moving else 1, 1, 1))
        for step, record in zip(steps, records, strict=True):
            known = record.base_from_tracked
            if len(record.time_s) > 1:
                known, _ = record.at(time_s, largest_gap_s=LARGEST_GAP_S)
            product = product @ (known if step in self._stated else np.linalg.inv(known))
        whole = np.isfinite(product).all(axis=(1, 2))
        return time_s[whole[: len(time_s)]], product[whole]

    def _record(self, target: str, source: str) -> PoseRecord:
        """A transform over its stamps, as it is stated; a fixed one has one."""
        key = (target, source) if (target, source) in self._stated else (source, target)
        stamps, values = map(np.array, self._stated[key])
        values = values.reshape(-1, 7)
        few = key in self._fixed or np.ptp(values, axis=0).max() < FIXED
        times_ns, first = np.unique(stamps[:1] if few else stamps, return_index=True)
        time_s = (times_ns - self.start_ns) / NANOSECONDS
        return PoseRecord(time_s, rigid(values[first]), np.full(len(first), np.nan))


def bag_poses(path: Path, topic: str | None, request: Request) -> Poses:
    """Poses of the tracked frame in the base frame, as the request names them, that a bag holds.

    ``topic`` is one of PoseStamped or of transforms; None finds one by its type.

    Raises
    ------
    ValueError
        If there are none or several, or the frames are not there, do not meet, or do not move.
    """
    with open_bag(path) as bag:
        tree, stamped = Tree(bag), list(bag.topics(POSE_STAMPED))
        moving = [name for name in bag.topics(TRANSFORMS) if not name.endswith(STATIC)]
        joints = list(bag.topics(JOINTS))
        if joints and not (moving or stamped):
            found = f"{shown(joints[0])} of joints' angles alone (no kinematics here: record /tf)"
            raise mismatch(f"{path}: poses", "/tf or PoseStamped", found)
        by_tree = bool(moving) and (not stamped or request.tracked in tree)
        if topic in moving if topic else by_tree:
            with named(path, "tf"):
                return _of_tree(tree, request)
        found = stamped if request.tracked else [*stamped, *moving]
        topic = chosen(bag, "poses", found, topic, "PoseStamped or TFMessage", held(bag))
        with named(path, shown(topic)):
            return replace(_of_topic(bag, topic, request), tree=tree)


def _of_tree(tree: Tree, request: Request) -> Poses:
    """Poses at the stamps of all transforms that move the tracked frame, where each is known."""
    tracked = plain(request.tracked or "")
    base = plain(request.base or tree.root(tracked))
    for name, frame in (("tracked", tracked), ("base", base)):
        if frame not in tree:
            expected = f"one of the frames {listed(tree.beside)}"
            raise mismatch(f"--{name}", expected, shown(frame) or "none")
    remedy = "record what joins them, or name another --base"
    time_s, poses = tree.path(base, tracked, remedy)
    if len(time_s) < 2:
        found = "fixed ones, or none at the same time (is it the probe's frame? --tracked)"
        raise mismatch("frames", f"transforms that move {tracked} in {base}", found)
    said = "" if request.base else ", the root of its tree (--base names another)"
    note = f"poses: {len(poses)} of {shown(tracked)} in {shown(base)}{said}"
    unknown = np.full(len(poses), np.nan)
    record = PoseRecord(tree.start_ns / NANOSECONDS + time_s, poses, unknown, base, tracked)
    return Poses(record, (note,), tree)


def _of_topic(bag: Bag, topic: str, request: Request) -> Poses:
    """Poses of a topic of PoseStamped, whose header names the base frame."""
    times_ns, values, frames = array("q"), array("d"), set()
    for _, received_ns, message in bag.messages([topic]):
        times_ns.append(stamp_ns(message, received_ns))
        values.extend(parts(message.pose.orientation, message.pose.position))
        frames.add(plain(message.header.frame_id))
    base = plain(request.base or min(frames))
    if frames - {"", base}:
        raise mismatch("frame_id", f"{base} (--base)", listed(frames))
    values = np.array(values).reshape(-1, 7)
    return pose_record(np.array(times_ns) / NANOSECONDS, values, base, request.tracked or "")


def placed(poses: Poses, camera: str) -> tuple[dict, tuple[str, ...]]:
    """Block ``base`` of a sensor's file, if transforms hold a camera's frame still, and notes."""
    base, camera = poses.record.base, plain(camera)
    if poses.tree is None or camera not in poses.tree.joined(base):
        return {}, ()
    time_s, found = poses.tree.path(camera, base, "")
    where = f"base: transforms say where {shown(camera)} is in {shown(base)}"
    if len(time_s):
        return {}, (f"{where}, but it moves: not used",)
    return {"name": base, "camera_from_base": rows(found[0])}, (where,)


def parts(turn: Any, shift: Any) -> list[float]:
    """x, y, z, w of a quaternion's message, and x, y, z of a vector's."""
    return [turn.x, turn.y, turn.z, turn.w, shift.x, shift.y, shift.z]


def plain(frame: str) -> str:
    """A frame's name without the slash that old ROS puts before it."""
    return frame.lstrip("/")


def listed(frames: Iterable[str]) -> str:
    """Names of frames, or the first of many."""
    names = [shown(name) for name in sorted(frames)]
    return ", ".join(names[:MOST_SHOWN]) + ", ..." * (len(names) > MOST_SHOWN)
