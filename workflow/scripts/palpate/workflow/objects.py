"""Objects of a run: those of the study, and what their results depend on beside their folders."""

import hashlib
import json
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

from palpate.capture.calibrations import PARTS
from palpate.capture.fingerprint import folder_fingerprint

# Objects of the study beside its block.
BALL, EAR = "foam_ball", "ear"


def studied(config: Mapping) -> set[str]:
    """Names of the study's objects: any other is of people's own, and gets a page of its own."""
    study = config["study"]
    return {study["block"], BALL, EAR, *study["captures"]}


def value_digest(value: Any) -> str:
    """Digest plain values, sixteen hexadecimal digits; a run keeps it for each of its jobs."""
    text = json.dumps(value, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def kept_files(name: str, sensors: Mapping, probe: Mapping, paths: Mapping) -> dict[str, str]:
    """Fingerprints of what stands outside an object's folder and its results depend on.

    Parameters
    ----------
    name : str
        The object.
    sensors : mapping
        Specifications by name, of the sensors that filmed it; None of a wrong file.
    probe : mapping
        File of the probe that it was pressed with; empty without one.
    paths : mapping
        Folders of the run.
    """
    folders = {
        f"sensors/{sensor}": Path(paths["raw"]) / "sensors" / sensor / "calibration"
        for sensor, spec in sensors.items()
        if (spec or {}).get("optics") == "calibration"
    }
    # A film of a probe is just for those whose file asks for what it tells.
    for part, sensor in product(PARTS, sensors):
        film = Path(paths["raw"]) / "sensors" / sensor / part.film
        if part.asking(probe) and film.is_dir():
            folders[f"{part.name}/{sensor}"] = film
    prints = {key: folder_fingerprint(folder) for key, folder in folders.items()}
    mesh = Path(paths["meshes"]) / f"{name}.vtu"
    if mesh.is_file():
        prints["mesh"] = hashlib.sha256(mesh.read_bytes()).hexdigest()[:16]
    return prints
