"""What Snakemake costs before the first job, with as many objects as a cluster is for.

``make bench sections=scale`` times the dry-run of 300 objects with 4 captures each.

``python tools/bench_scale.py <folder> <objects>`` writes a raw/ tree of that many objects, each
with two sensors and 18 points: valid captures of 24 frames, hard links of copies of the sample's.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import yaml

SAMPLE = Path(__file__).resolve().parents[1] / "tests/sample/raw/foam_block"
SENSORS = {"bumblebee": ("left", "right"), "kinect": ("color", "depth")}
POINTS = tuple(f"{k:02}" for k in range(1, 19))
FRAMES = 24
# A file of ext4 has no more names than this.
LINKS = 60_000
OBJECTS, FEW = 300, ("01", "02")
ROOT = Path(__file__).resolve().parents[1]


def write_tree(raw: Path, objects: int, *, points: tuple[str, ...] = POINTS) -> int:
    """Write objects with valid captures.

    Parameters
    ----------
    raw : Path
        Folder to make.
    objects : int
        Number of objects ``object_0000``, ...
    points : tuple of str, optional
        Pressed points of each object with each sensor.

    Returns
    -------
    int
        Number of captures.

    Raises
    ------
    ValueError
        If a file would need more names than a file system gives it.
    """
    if objects * len(points) > LINKS:
        raise ValueError(f"objects: expected at most {LINKS // len(points)}, found {objects}")
    raw.mkdir(parents=True)
    models = {sensor: _model(raw / f".{sensor}", sensor) for sensor in SENSORS}
    description = yaml.safe_load((SAMPLE / "object.yaml").read_text())
    for number in range(objects):
        folder = raw / f"object_{number:04}"
        folder.mkdir()
        spec = description | {"object": folder.name, "provenance": "recorded"}
        (folder / "object.yaml").write_text(yaml.safe_dump(spec))
        shutil.copy(SAMPLE / "template.ply", folder)
        for sensor, model in models.items():
            (folder / sensor).mkdir()
            _linked(model.with_name(f"{model.name}_background"), folder / sensor / "background")
            for number_of_press, point in enumerate(points, start=1):
                _linked(model, folder / sensor / point)
                _another_force(folder / sensor / point / "force.csv", by_s=1e-3 * number_of_press)
    return objects * len(points) * len(SENSORS)


def _model(folder: Path, sensor: str) -> Path:
    """One capture of as many frames as the study's, from the sample's shorter one; a background."""
    source = SAMPLE / sensor / "08"
    shutil.copytree(source, folder)
    shutil.copytree(source.with_name("background"), folder.with_name(f"{folder.name}_background"))
    table = pd.read_csv(source / "frames.csv")
    times = table["time_s"].to_numpy()
    longer = pd.DataFrame({"frame": range(FRAMES)})
    longer["time_s"] = np.linspace(times[0], times[-1], FRAMES).round(6)
    for stream in SENSORS[sensor]:
        longer[stream] = [f"{stream}/{k:06}.png" for k in range(FRAMES)]
        for k in range(len(table), FRAMES):
            name = source / table[stream][k % len(table)]
            _changed(name, folder / longer[stream][k], by=k // len(table))
    longer.to_csv(folder / "frames.csv", index=False)
    return folder


def _changed(source: Path, target: Path, *, by: int) -> None:
    """Copy an image with one pixel changed: no sensor takes the same image twice."""
    image = cv2.imread(str(source), cv2.IMREAD_UNCHANGED)
    image[0, 0] ^= by
    cv2.imwrite(str(target), image)


def _another_force(path: Path, *, by_s: float) -> None:
    """Give a capture a record of its own: the very same one under two names is refused."""
    text = path.read_text()
    time, *values = text.splitlines()[-1].split(",")
    path.unlink()
    path.write_text(text + ",".join([f"{float(time) + by_s:.6f}", *values]) + "\n")


def _linked(source: Path, target: Path) -> None:
    shutil.copytree(source, target, copy_function=os.link)


def scale_rows(objects: int = OBJECTS) -> list[tuple]:
    """Clock, processor and memory of the dry-run of many objects."""
    with tempfile.TemporaryDirectory(dir=os.environ.get("TMPDIR")) as name:
        folder = Path(name)
        captures = write_tree(folder / "raw", objects, points=FEW)
        seconds, processor_s, memory_gb = _dry_run(folder)
    what = f"dry-run of {objects} objects, {captures} captures"
    return [
        (f"{what}: clock", seconds, "s", "120 s"),
        (f"{what}: processor", processor_s, "s", "120 s"),
        (f"{what}: peak memory", memory_gb, "GB", "2 GB"),
    ]


def _dry_run(folder: Path) -> tuple[float, float, float]:
    """Clock [s], processor [s] and peak memory [GB] of the dry-run over a raw/ tree."""
    paths = {"raw": str(folder / "raw"), "results": str(folder / "results")}
    paths |= {"sensors": "tests/sample/sensors", "lab": None}
    (folder / "run.yaml").write_text(yaml.safe_dump({"paths": paths}))
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--dry-run", "--quiet", "all"]
    command += ["--configfile", str(folder / "run.yaml")]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    seconds = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, processor_s, after.ru_maxrss / 1e6


if __name__ == "__main__":
    try:
        print(write_tree(Path(sys.argv[1]), int(sys.argv[2])), "captures")
    except (OSError, ValueError) as error:
        sys.exit(f"error: scale: {error}")
