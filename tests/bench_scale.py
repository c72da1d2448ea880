"""What Snakemake costs before the first job, with as many objects as a cluster is for.

``python tests/bench_scale.py <folder> <objects>`` writes a raw/ tree of that many objects, each
with two sensors and 18 points, as hard links of the sample's files: valid captures of 24 frames.
"""

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

SAMPLE = Path(__file__).resolve().parent / "sample" / "raw" / "foam_block"
SENSORS = {"bumblebee": ("left", "right"), "kinect": ("color", "depth")}
POINTS = tuple(f"{k:02}" for k in range(1, 19))
FRAMES = 24
# A file of ext4 has no more names than this.
LINKS = 60_000


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
            _linked(SAMPLE / sensor / "background", folder / sensor / "background")
            for point in points:
                _linked(model, folder / sensor / point)
    return objects * len(points) * len(SENSORS)


def _model(folder: Path, sensor: str) -> Path:
    """One capture of as many frames as the study's, from the sample's shorter one."""
    source = SAMPLE / sensor / "08"
    shutil.copytree(source, folder)
    table = pd.read_csv(source / "frames.csv")
    times = table["time_s"].to_numpy()
    longer = pd.DataFrame({"frame": range(FRAMES)})
    longer["time_s"] = np.linspace(times[0], times[-1], FRAMES).round(6)
    for stream in SENSORS[sensor]:
        longer[stream] = [f"{stream}/{k:06}.png" for k in range(FRAMES)]
        for k in range(len(table), FRAMES):
            shutil.copy(source / table[stream][k % len(table)], folder / longer[stream][k])
    longer.to_csv(folder / "frames.csv", index=False)
    return folder


def _linked(source: Path, target: Path) -> None:
    shutil.copytree(source, target, copy_function=os.link)


if __name__ == "__main__":
    try:
        print(write_tree(Path(sys.argv[1]), int(sys.argv[2])), "captures")
    except (OSError, ValueError) as error:
        sys.exit(f"error: scale: {error}")
