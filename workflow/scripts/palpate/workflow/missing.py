"""Recordings that files of sensors and probes ask for and nobody made; and how a run is ended."""

import sys
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import NoReturn

from palpate.capture.calibrations import PARTS


def refuse(error: ValueError) -> NoReturn:
    """End Snakemake with an error's lines, as jobs end with theirs, and the exit status 1.

    An exception would be shown with its name and with lines of the workflow's code, and with
    ``--quiet all`` not at all.
    """
    sys.stderr.write("".join(f"error: {line}\n" for line in str(error).splitlines()))
    raise SystemExit(1) from None


def require_values(given: Mapping) -> None:
    """Reject what stands after ``--config`` without a value: it would mean that none is wanted.

    Raises
    ------
    ValueError
        With one line for each entry that is empty.
    """
    hint = "leave it out for what the configuration says"
    empty = [name for name, value in given.items() if value is None]
    if empty:
        lines = [f"--config {name}=: expected a value, found nothing ({hint})" for name in empty]
        raise ValueError("\n".join(lines))


def lab_devices(lab: Mapping | None) -> dict[str, set[str]]:
    """Names of the sensors and probes that a lab records with, whatever is asked for."""
    objects = (lab or {}).get("objects", {}).values()
    blocks = (lab or {}).get("experiments", {}).values()
    sensors = [name for spec in objects for name in (*spec["recordings"], *spec["cameras"])]
    sensors += [name for block in blocks for name in block["sensors"]]
    probes = [spec["object"]["probe"] for spec in objects]
    probes += [block["probe"] for block in blocks if "probe" in block]
    return {"sensors": set(sensors), "probes": set(probes)}


def missing_calibrations(
    used: set[str], sensors: Mapping, lab: Mapping | None, paths: Mapping
) -> list[str]:
    """Sensors whose optics are to come from pictures of a target that nobody took, a line each."""
    made = (lab or {}).get("experiments", {}).get("calibration", {"sensors": []})["sensors"]
    lines = []
    for name in sorted(used & {name for name, sensor in sensors.items() if sensor}):
        folder = Path(paths["raw"]) / "sensors" / name / "calibration"
        asked = sensors[name].get("optics") == "calibration"
        place = Path(paths["sensors"]) / f"{name}.yaml"
        if asked and "depth" not in sensors[name]:
            # Its images are rectified: the camera that they show is none of those before the board.
            expected = "stated, those of `palpate calibrate camera --kind stereo`"
            lines.append(f"{place}: optics: expected {expected}, found calibration")
        elif asked and name not in made and not folder.is_dir():
            lines.append(f"{place}: optics: expected pictures of a board in {folder}, found none")
    return lines


def missing_films(
    used: Mapping[tuple[str, str], Mapping], lab: Mapping | None, paths: Mapping, filmed: str
) -> list[str]:
    """Probes whose file asks for what a recording shows that nobody took, a line each.

    Parameters
    ----------
    used : mapping
        Object and sensor to the probe's file.
    lab, paths : mapping
    filmed : str
        Probe of the recordings about sensors.
    """
    experiments, lines = (lab or {}).get("experiments", {}), []
    for key, part in product(sorted(used), PARTS):
        sensor, probe = key[1], used[key]
        if (field := part.asking(probe)) is None:
            continue
        folder = Path(paths["raw"]) / "sensors" / sensor / part.film
        place = f"{Path(paths['probes']) / probe['probe']}.yaml"
        made = experiments.get(part.film, {"sensors": []})["sensors"]
        if sensor not in made and not folder.is_dir():
            expected = f"a film of {part.shows} in {folder}"
            lines.append(f"{place}: {field}: expected {expected}, found none")
        elif filmed != probe["probe"]:
            expected = f"a film of {probe['probe']} (experiments.probe, in config/config.yaml)"
            lines.append(f"{place}: {field}: expected {expected}, found one of {filmed or 'none'}")
    return list(dict.fromkeys(lines))
