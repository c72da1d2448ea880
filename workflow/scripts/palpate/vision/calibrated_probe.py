"""A probe's file with what a run's calibrations of a sensor tell of it."""

from collections.abc import Mapping, Sequence
from math import degrees, hypot
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.capture.devices import CALIBRATION, asked, require_met
from palpate.config.sensor import rigid_fault
from palpate.json_fields import numbers_of, read_fields
from palpate.units import MILLIMETRES
from palpate.vision.load import CENTRE, TURN
from palpate.vision.load_json import CENTRE_M, MASS_KG, TURN_DEG
from palpate.vision.pivot_json import CALIBRATED, COVARIANCE, probe_with_tip, with_tip_at
from palpate.vision.probe import marker_from_tip

# Axes that are farther from what the probe's file says are of another probe, or of wrong signs.
FARTHEST_TURN_DEG = 20.0


def calibrated_probe(spec: Mapping, paths: Sequence[str | Path]) -> Mapping:
    """The probe's file, with numbers and deviations of a sensor's calibrations where it asks.

    Parameters
    ----------
    spec : mapping
        The probe's file.
    paths : sequence of paths
        load.json, tip.json and stiffness.json, those that the file asks for at least.

    Raises
    ------
    ValueError
        If a calibration is missing, is that of another probe, or does not tell what it is for.
    """
    wanted, found = asked(spec), {Path(path).stem: path for path in paths}
    require_met({name: field for name, field in wanted.items() if name not in found}, spec)
    for name in wanted:
        _require_same_probe(spec, found[name])
        spec = TAKEN[name](spec, found[name])
    return spec


def _require_same_probe(spec: Mapping, path: str | Path) -> None:
    """Refuse a calibration that names another probe; of a board's file alone it names none."""
    filmed, name = read_fields(path).get("probe"), spec["probe"]
    if filmed is not None and filmed != name:
        raise ValueError(f"{path}: probe: expected {name}, whose file asks for it, found {filmed}")


def _with_load(spec: Mapping, path: str | Path) -> Mapping:
    """What hangs on the sensor, and its rotation against the board; its place stays the file's.

    So does that of a tip that was found in the board's frame, or is to be held to such a one; a
    drawing's turns with the sensor.
    """
    fields, taken = read_fields(path), dict(spec)
    if spec.get("load") == CALIBRATION:
        taken["load"] = _load(path, fields) | {"origin": CALIBRATED}
    if spec.get("axes") == CALIBRATION:
        transform = np.array(spec["marker_from_force"], dtype=float)
        transform[:3, :3], std_rad = _axes(path, fields, transform[:3, :3])
        taken |= {"marker_from_force": transform.tolist(), "axes_std_rad": std_rad}
        taken["axes"] = CALIBRATED
        if COVARIANCE in spec or spec.get("tip") == CALIBRATION:
            taken = with_tip_at(taken, marker_from_tip(spec)[:3, 3])
    return taken


def _load(path: str | Path, fields: Mapping) -> dict:
    mass_kg, std_kg = (float(numbers_of(path, fields, k, ())) for k in ("mass_kg", "mass_std_kg"))
    centre_m = numbers_of(path, fields, "centre_of_mass_m", (3,))
    covariance = _covariance(path, fields)
    centre_std_m = float(np.sqrt(np.diag(covariance)[CENTRE].max()))
    _require_told(path, "mass_kg", std_kg * 1e3, MASS_KG * 1e3, "g")
    _require_told(
        path, "centre_of_mass_m", centre_std_m * MILLIMETRES, CENTRE_M * MILLIMETRES, "mm"
    )
    return {"mass_kg": mass_kg, "mass_std_kg": std_kg, "centre_of_mass_m": centre_m.tolist()}


def _axes(path: str | Path, fields: Mapping, stated: NDArray) -> tuple[NDArray, float]:
    """Rotation of the sensor in the board's frame, and its deviation [rad]."""
    name = "marker_from_force_rotation"
    turn, transform = numbers_of(path, fields, name, (3, 3)), np.eye(4)
    transform[:3, :3] = turn
    if fault := rigid_fault(transform.tolist()):
        raise ValueError(f"{path}: {name}: expected a rotation, found {fault}")
    # What the vertical is off by is in the whole deviation, and no poses make it less.
    poses_rad = float(np.sqrt(np.linalg.eigvalsh(_covariance(path, fields)[TURN, TURN])[-1]))
    _require_told(path, name, degrees(poses_rad), TURN_DEG, "degrees")
    std_rad = float(numbers_of(path, fields, "axes_std_rad", ()))
    if not std_rad >= poses_rad:
        raise ValueError(
            f"{path}: axes_std_rad: expected no less than the covariance says, {poses_rad:.2g},"
            f" found {std_rad:.2g}"
        )
    away_deg = degrees(Rotation.from_matrix(turn.T @ stated).magnitude())
    if away_deg > FARTHEST_TURN_DEG:
        raise ValueError(
            f"{path}: {name}: expected within {FARTHEST_TURN_DEG:g} degrees of how the probe's file"
            f" has it (marker_from_force), found it {away_deg:.0f} degrees away"
        )
    return turn, std_rad


def _covariance(path: str | Path, fields: Mapping) -> NDArray:
    return numbers_of(path, fields, "covariance", (13, 13))


def _require_told(path: str | Path, name: str, std: float, most: float, unit: str) -> None:
    if not 0 < std <= most:
        raise ValueError(
            f"{path}: {name}: expected one that is told to {most:g} {unit}, found one to"
            f" {std:.2g} {unit} (its verdict says what would tell it)"
        )


def _with_stiffness(spec: Mapping, path: str | Path) -> Mapping:
    """What it gives way by; of one that is stiffer than is told nothing but the deviation."""
    fields = read_fields(path)
    names = "compliance_m_n", "compliance_std_m_n"
    given_m_n, std_m_n = (float(numbers_of(path, fields, name, ())) for name in names)
    taken = {key: value for key, value in spec.items() if key != "stiffness_n_m"}
    taken["stiffness"] = CALIBRATED
    if fields.get("stiffness_n_m") is None:
        return taken | {"compliance_std_m_n": hypot(std_m_n, given_m_n)}
    stiffness_n_m = float(numbers_of(path, fields, "stiffness_n_m", ()))
    if not stiffness_n_m > 0:
        raise ValueError(
            f"{path}: stiffness_n_m: expected a number above 0, found {stiffness_n_m:g}"
        )
    return taken | {"stiffness_n_m": stiffness_n_m, "compliance_std_m_n": std_m_n}


# What takes each part of `palpate.capture.devices.PARTS`.
TAKEN = {"load": _with_load, "tip": probe_with_tip, "stiffness": _with_stiffness}
