"""A small copy of the sample that a mutation may spoil."""

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import yaml
from settings import full

ROOT = Path(__file__).resolve().parents[2]
OBJECT, SENSOR, CAPTURE = "foam_block", "kinect", "08"
GAUGES = [f"v{k}" for k in range(6)]
WRENCH = ["fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm"]


@dataclass(frozen=True)
class Mutation:
    """One thing spoilt.

    Attributes
    ----------
    kind : str
        Group that it belongs to.
    name : str
        Unique within the kind.
    file : str
        What is changed, as people know it.
    change : callable
        Takes the `Place`.
    volts : bool
        Whether the capture holds gauge volts as the sample does; else a wrench in newtons.
    option : bool
        A valid choice may give another result; only its end is looked at.
    told : str
        Why nobody can know, where a wrong number may come out; told in the table.
    job : str
        Script that reads the spoilt result; empty where captures are spoilt.
    """

    kind: str
    name: str
    file: str
    change: Callable[["Place"], None]
    volts: bool = True
    option: bool = False
    told: str = ""
    job: str = ""

    @property
    def key(self) -> str:
        """Name in the table."""
        return f"{self.kind}: {self.name}"


class Place:
    """Folder with raw/, sensors/, probes/ and a configuration."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.object = folder / "raw" / OBJECT
        self.sensor = self.object / SENSOR
        self.capture = self.sensor / CAPTURE
        self.background = self.sensor / "background"
        self.config = read_config()
        self.results = folder / "results" / OBJECT / SENSOR / CAPTURE

    @classmethod
    def relative(cls, place: "Place") -> "Place":
        """The same place as seen from within it, as Snakemake names files."""
        inside = cls(Path())
        inside.config = place.config
        return inside

    def write(self, path: Path, content: bytes | str) -> None:
        """Replace a file; its other hard links keep what they hold."""
        path.unlink(missing_ok=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)

    def csv(self, path: Path, change: Callable[[pd.DataFrame], object]) -> None:
        """Change a table in place, or replace it by what the change gives."""
        table = pd.read_csv(path)
        changed = change(table)
        table = table if changed is None else changed
        self.write(path, table.to_csv(index=False, lineterminator="\n"))

    def yaml(self, path: Path, change: Callable[[dict], object]) -> None:
        """Change a YAML file's content."""
        spec = yaml.safe_load(path.read_text())
        changed = change(spec)
        self.write(path, yaml.safe_dump(spec if changed is None else changed, sort_keys=False))

    def listing(self) -> dict[str, tuple[int, int]]:
        """Sizes and times of all files but those of results/."""
        found = {}
        for folder, names, files in os.walk(self.folder):
            if Path(folder) == self.folder and "results" in names:
                names.remove("results")
            for name in files:
                status = os.lstat(os.path.join(folder, name))
                found[os.path.join(folder, name)] = (status.st_size, status.st_mtime_ns)
        return found


def read_config() -> dict:
    """The study's configuration, as the sample's, with paths inside a place."""
    config = full(ROOT)
    sample = yaml.safe_load((ROOT / "tests/sample/config.yaml").read_text())
    config["direct"]["model"] |= sample["direct"]["model"]
    config["paths"] |= {
        "raw": "raw",
        "results": "results",
        "sensors": "sensors",
        "probes": "probes",
        "meshes": "meshes",
        "lab": None,
    }
    return config


def make_bases(work: Path) -> dict[bool, Path]:
    """Two whole places, with volts and with a wrench, of which mutations get linked copies."""
    bases = {True: work / "volts", False: work / "wrench"}
    for folder in bases.values():
        raw = folder / "raw" / OBJECT
        raw.mkdir(parents=True)
        source = ROOT / "tests/sample/raw" / OBJECT
        for name in ("object.yaml", "template.ply"):
            shutil.copy(source / name, raw / name)
        shutil.copytree(source / SENSOR, raw / SENSOR)
        (folder / "sensors").mkdir()
        shutil.copy(ROOT / "tests/sample/sensors/kinect.yaml", folder / "sensors")
        shutil.copytree(ROOT / "config/probes", folder / "probes")
        (folder / "meshes").mkdir()
        (folder / "results").mkdir()
    in_newtons(Place(bases[False]))
    return bases


def in_newtons(place: Place) -> None:
    """Turn a capture's volts into the wrench that they stand for."""
    probe = yaml.safe_load((place.folder / "probes/nano25_sphere.yaml").read_text())
    table = pd.read_csv(place.capture / "force.csv")
    wrench = table[GAUGES].to_numpy() @ pd.DataFrame(probe["gauge"]["calibration"]).to_numpy().T
    rows = pd.DataFrame(wrench, columns=WRENCH)
    rows.insert(0, "time_s", table["time_s"])
    place.write(place.capture / "force.csv", rows.to_csv(index=False, float_format="%.9g"))


def linked_copy(base: Path, folder: Path) -> Place:
    """A copy whose files are hard links: writes go through `Place.write`."""
    shutil.copytree(base, folder, copy_function=os.link, symlinks=True)
    return Place(folder)
