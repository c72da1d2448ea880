"""Folders with copies of the committed captures, which entries corrupt."""

import os
import shutil
from pathlib import Path

import yaml
from settings import full

ROOT = Path(__file__).resolve().parents[2]
BLOCK, COW = "raw/foam_block", "raw/toy_cow"
# What each place has, and of where.
FILES = {
    "block": {
        f"{BLOCK}/object.yaml": f"tests/sample/{BLOCK}/object.yaml",
        f"{BLOCK}/template.ply": f"tests/sample/{BLOCK}/template.ply",
        f"{BLOCK}/kinect": f"tests/sample/{BLOCK}/kinect",
        "config/sensors/kinect.yaml": "tests/sample/sensors/kinect.yaml",
        "config/probes/nano25_sphere.yaml": "config/probes/nano25_sphere.yaml",
        "config/meshes/foam_block.vtu": "config/meshes/foam_block.vtu",
        "curve.csv": "tests/real/curves/fmt-jpk-fd_spot3-0192_0.csv",
    },
    "cow": {
        f"{COW}/object.yaml": f"tests/own_object/{COW}/object.yaml",
        f"{COW}/template.ply": f"tests/own_object/{COW}/template.ply",
        f"{COW}/bench_cam/back": f"tests/own_object/{COW}/bench_cam/back",
        f"{COW}/bench_cam/background": f"tests/own_object/{COW}/bench_cam/background",
        "config/sensors/bench_cam.yaml": "tests/own_object/sensors/bench_cam.yaml",
        "config/probes/bench_probe.yaml": "tests/own_object/probes/bench_probe.yaml",
    },
}


def place_of(path: str) -> str:
    """The place whose file it is."""
    return "cow" if "cow" in path or "bench" in path else "block"


def configuration() -> dict:
    """The configuration of a run in a place."""
    config = full(ROOT)
    sample = yaml.safe_load((ROOT / "tests/sample/config.yaml").read_text())
    config["direct"]["model"] |= sample["direct"]["model"]
    return config | {"paths": config["paths"] | {"lab": None}}


def make_places(work: Path) -> None:
    """Make the uncorrupted places."""
    for place, files in FILES.items():
        for name, source in files.items():
            target, source = work / place / name, ROOT / source
            target.parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if source.is_dir() else shutil.copy)(source, target)
        (work / place / "config.yaml").write_text(yaml.safe_dump(configuration(), sort_keys=False))


def enter_copy(work: Path, place: str) -> None:
    """Make a copy of a place, of hard links, and go there."""
    shutil.rmtree(work / "now", ignore_errors=True)
    shutil.copytree(work / place, work / "now", copy_function=os.link, symlinks=True)
    os.chdir(work / "now")


def listing() -> dict[str, tuple[int, int]]:
    """Sizes and times of all files in and beside the current folder but those of its results."""
    found = {}
    for folder, names, files in os.walk(".."):
        if folder == "../now" and "results" in names:
            names.remove("results")
        for name in files:
            status = os.lstat(os.path.join(folder, name))
            found[os.path.join(folder, name)] = (status.st_size, status.st_mtime_ns)
    return found
