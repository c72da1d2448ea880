"""A probe's file, and a sensor's, with what a run's calibrations of the sensor say of them."""

from collections.abc import Mapping, Sequence
from math import degrees, hypot
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.config.probe import asked, require_met
from palpate.config.sensor import (
    CALIBRATION,
    HAND_EYE,
    BaseSpec,
    asks_for_base,
    covariance_fault,
    rigid_fault,
)
from palpate.json_fields import numbers_of, read_fields
from palpate.units import MILLIMETRES
from palpate.vision.payload import CENTRE, CENTRE_M, MASS_KG, TURN, TURN_DEG
from palpate.vision.pivot import LARGEST_STD_M, largest_std
from palpate.vision.probe import marker_from_tip
from palpate.yaml_files import mismatch

# Axes that are farther from what the probe's file says are of another probe, or of wrong signs;
# a tip that is farther is another probe's.
FARTHEST_TURN_DEG, FARTHEST_M = 20.0, 0.02
# What is left where a probe's file asked for a calibration that was taken.
CALIBRATED = "calibrated"
COVARIANCE = "tip_covariance_m2"


def calibrated_probe(spec: Mapping, paths: Sequence[str | Path]) -> Mapping:
    """The probe's file, with numbers and deviations of a sensor's calibrations where it asks.

    The paths are of load.json, tip.json and stiffness.json, those that it asks for at least.

    Raises
    ------
    ValueError
        If a calibration is missing, is that of another probe, or does not determine what it is for.
    """
    wanted, found = asked(spec), {Path(path).stem: path for path in paths}
    require_met({name: field for name, field in wanted.items() if name not in found}, spec)
    for name in wanted:
        path, fields = found[name], read_fields(found[name])
        # Of a target's file alone a calibration names no probe.
        if fields.get("probe") not in (None, spec["probe"]):
            expected = f"{spec['probe']}, whose file asks for it"
            raise mismatch(f"{path}: probe", expected, fields["probe"])
        spec = TAKEN[name](spec, path, fields)
    return spec


def placed_sensor(spec: Mapping, paths: Sequence[str | Path]) -> Mapping:
    """The sensor's file, with the place of a robot's or tracker's base where it asks for it.

    It still asks where none of the paths, a run's calibrations, is hand_eye.json.

    Raises
    ------
    ValueError
        If hand_eye.json is another sensor's, or does not determine where the base is.
    """
    path = next((path for path in paths if Path(path).stem == HAND_EYE), None)
    if path is None or not asks_for_base(spec):
        return spec
    fields = read_fields(path)
    if fields.get("sensor", spec["sensor"]) != spec["sensor"]:
        raise ValueError(f"{path}: sensor: expected {spec['sensor']}, found {fields['sensor']}")
    shapes = {"camera_from_base": (4, 4), "covariance": (6, 6)}
    found = {name: numbers_of(path, fields, name, of).tolist() for name, of in shapes.items()}
    try:
        BaseSpec.read(found, str(path))
    except ValueError as error:
        line = str(error).splitlines()[0]
        raise ValueError(f"{line} (its verdict says what would determine it)") from None
    return dict(spec) | {"base": dict(spec["base"]) | found | {"origin": CALIBRATED}}


def with_tip_at(spec: Mapping, tip_m: NDArray) -> dict:
    """The probe's file with its tip at (3,) in the target's frame [m].

    The tip's axes stay: a ball has no axis of its own, and the probe presses along the sensor's z,
    as its drawing has it. The line from the sensor's origin to the tip would put a tip's error
    across into the direction.
    """
    fixed, transform = (np.array(spec[k], float) for k in ("marker_from_force", "force_from_tip"))
    transform[:3, 3] = fixed[:3, :3].T @ (tip_m - fixed[:3, 3])
    return dict(spec) | {"force_from_tip": transform.tolist()}


def _with_tip(spec: Mapping, path: str | Path, fields: Mapping) -> Mapping:
    """Tip and covariance."""
    tip_m = numbers_of(path, fields, "tip_m", (3,))
    covariance = numbers_of(path, fields, COVARIANCE, (3, 3))
    if fault := covariance_fault(covariance):
        raise ValueError(f"{path}: {COVARIANCE}: {fault}")
    _require_determined(path, "tip_m", largest_std(covariance), LARGEST_STD_M, MILLIMETRES, "mm")
    away_m = float(np.linalg.norm(tip_m - marker_from_tip(spec)[:3, 3]))
    if away_m > FARTHEST_M:
        expected = f"within {FARTHEST_M * MILLIMETRES:g} mm of where the probe's file has it"
        found = f"it {away_m * MILLIMETRES:.0f} mm away"
        raise mismatch(f"{path}: tip_m", f"{expected} (force_from_tip)", found)
    return with_tip_at(spec, tip_m) | {COVARIANCE: covariance.tolist(), "tip": CALIBRATED}


def _with_payload(spec: Mapping, path: str | Path, fields: Mapping) -> Mapping:
    """The payload, and the sensor's rotation against the target; its place stays the file's."""
    taken = dict(spec)
    if spec.get("load") == CALIBRATION:
        mass, name = ("mass_kg", "mass_std_kg"), "centre_of_mass_m"
        load = {key: float(numbers_of(path, fields, key, ())) for key in mass}
        load[name] = numbers_of(path, fields, name, (3,)).tolist()
        variance = np.diag(numbers_of(path, fields, "covariance", (13, 13)))[CENTRE].max()
        _require_determined(path, "mass_kg", load["mass_std_kg"], MASS_KG, 1e3, "g")
        _require_determined(path, name, np.sqrt(variance), CENTRE_M, MILLIMETRES, "mm")
        taken["load"] = load | {"origin": CALIBRATED}
    if spec.get("axes") == CALIBRATION:
        transform = np.array(spec["marker_from_force"], dtype=float)
        transform[:3, :3], std_rad = _axes(path, fields, transform[:3, :3])
        taken |= {"marker_from_force": transform.tolist(), "axes_std_rad": std_rad}
        taken["axes"] = CALIBRATED
        # A tip that is found in the target's frame stays there; a drawing's turns with the sensor.
        if COVARIANCE in spec or spec.get("tip") == CALIBRATION:
            taken = with_tip_at(taken, marker_from_tip(spec)[:3, 3])
    return taken


def _axes(path: str | Path, fields: Mapping, stated: NDArray) -> tuple[NDArray, float]:
    """Rotation of the sensor in the target's frame, and its deviation [rad]."""
    name = "marker_from_force_rotation"
    turn, transform = numbers_of(path, fields, name, (3, 3)), np.eye(4)
    transform[:3, :3] = turn
    if fault := rigid_fault(transform.tolist()):
        raise ValueError(f"{path}: {name}: expected a rotation, found {fault}")
    # What the vertical is off by is in the whole deviation, and no poses make it less.
    poses_rad = largest_std(numbers_of(path, fields, "covariance", (13, 13))[TURN, TURN])
    _require_determined(path, name, degrees(poses_rad), TURN_DEG, 1, "degrees")
    std_rad = float(numbers_of(path, fields, "axes_std_rad", ()))
    if not std_rad >= poses_rad:
        expected = f"no less than the covariance says, {poses_rad:.2g}"
        raise mismatch(f"{path}: axes_std_rad", expected, f"{std_rad:.2g}")
    away_deg = degrees(Rotation.from_matrix(turn.T @ stated).magnitude())
    if away_deg > FARTHEST_TURN_DEG:
        expected = f"within {FARTHEST_TURN_DEG:g} degrees of how the probe's file has it"
        found = f"it {away_deg:.0f} degrees away"
        raise mismatch(f"{path}: {name}", f"{expected} (marker_from_force)", found)
    return turn, std_rad


def _require_determined(
    path: str | Path, name: str, std: float, most: float, scale: float, unit: str
) -> None:
    if not 0 < std <= most:
        expected = f"one that is determined to {most * scale:g} {unit}"
        found = f"one to {std * scale:.2g} {unit} (its verdict says what would determine it)"
        raise mismatch(f"{path}: {name}", expected, found)


def _with_stiffness(spec: Mapping, path: str | Path, fields: Mapping) -> Mapping:
    """The stiffness; of one that is not determined the deviation of its compliance alone."""
    names = "compliance_m_n", "compliance_std_m_n"
    given_m_n, std_m_n = (float(numbers_of(path, fields, name, ())) for name in names)
    taken = {key: value for key, value in spec.items() if key != "stiffness_n_m"}
    taken["stiffness"] = CALIBRATED
    if fields.get("stiffness_n_m") is None:
        return taken | {"compliance_std_m_n": hypot(std_m_n, given_m_n)}
    stiffness_n_m = float(numbers_of(path, fields, "stiffness_n_m", ()))
    if not stiffness_n_m > 0:
        raise mismatch(f"{path}: stiffness_n_m", "a number above 0", f"{stiffness_n_m:g}")
    return taken | {"stiffness_n_m": stiffness_n_m, "compliance_std_m_n": std_m_n}


# What takes each part of `palpate.config.probe.PARTS`.
TAKEN = {"load": _with_payload, "tip": _with_tip, "stiffness": _with_stiffness}
