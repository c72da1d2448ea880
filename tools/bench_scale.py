"""What Snakemake costs before the first job, with as many objects as a cluster is for.

``make bench sections=scale`` times the dry-run of 300 objects with 4 captures each.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml
from longer_capture import SAMPLE, write_capture

ROOT = Path(__file__).resolve().parents[1]
OBJECT = SAMPLE / "raw/foam_block"
OBJECTS, SENSORS, POINTS, FRAMES = 300, ("bumblebee", "kinect"), ("01", "02"), 24


def _write_tree(raw: Path) -> int:
    """Write objects with valid captures, hard links of the sample's; returns how many captures."""
    raw.mkdir(parents=True)
    for sensor in SENSORS:
        write_capture(OBJECT / sensor / "08", raw / f".{sensor}/capture", frames=FRAMES)
        shutil.copytree(OBJECT / sensor / "background", raw / f".{sensor}/background")
    description = yaml.safe_load((OBJECT / "object.yaml").read_text())
    for number in range(OBJECTS):
        folder = raw / f"object_{number:04}"
        folder.mkdir()
        spec = description | {"object": folder.name, "provenance": "recorded"}
        (folder / "object.yaml").write_text(yaml.safe_dump(spec))
        shutil.copy(OBJECT / "template.ply", folder)
        for sensor in SENSORS:
            _linked(raw / f".{sensor}/background", folder / sensor / "background")
            for k, point in enumerate(POINTS, start=1):
                _linked(raw / f".{sensor}/capture", folder / sensor / point)
                _another_force(folder / sensor / point / "force.csv", by_s=1e-3 * k)
    return OBJECTS * len(POINTS) * len(SENSORS)


def _another_force(path: Path, *, by_s: float) -> None:
    """Give a capture a record of its own: the very same one under two names is rejected."""
    text = path.read_text()
    time, *values = text.splitlines()[-1].split(",")
    path.unlink()
    path.write_text(text + ",".join([f"{float(time) + by_s:.6f}", *values]) + "\n")


def _linked(source: Path, target: Path) -> None:
    shutil.copytree(source, target, copy_function=os.link)


def scale_rows() -> list[tuple]:
    """Clock, processor and memory of the dry-run of many objects."""
    with tempfile.TemporaryDirectory(dir=os.environ.get("TMPDIR")) as name:
        folder = Path(name)
        captures = _write_tree(folder / "raw")
        seconds, processor_s, memory_gb = _dry_run(folder)
    what = f"dry-run of {OBJECTS} objects, {captures} captures"
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
