"""Recordings about sensors and probes that files ask for and nobody took, a line for each."""

from collections.abc import Mapping
from itertools import product
from pathlib import Path

from palpate.capture.calibrations import PARTS


def missing_calibrations(
    used: set[str], sensors: Mapping, lab: Mapping | None, paths: Mapping
) -> list[str]:
    """Sensors whose optics are to come from pictures of a board that nobody took."""
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
    """Probes of which a film is to tell something that nobody took.

    Parameters
    ----------
    used : mapping
        Object and sensor to the probe's file.
    lab, paths : mapping
    filmed : str
        Probe of the recordings about sensors.
    """
    experiments, lines = (lab or {}).get("experiments", {}), []
    for ((_, sensor), probe), part in product(sorted(used.items(), key=_named), PARTS):
        # A file of a probe that is wrong is lacking itself.
        if probe is None or (field := part.asking(probe)) is None:
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


def _named(used: tuple[tuple[str, str], Mapping]) -> tuple[str, str]:
    return used[0]
