"""Direct estimates beside the other methods, and all of them against the lab's truth."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np
import pandas as pd

from palpate.estimate.direct.warnings import Estimated, exclusions
from palpate.modulus import IDENTIFIED, LABELS, Modulus, bounded_at_best, columns
from palpate.report.style import sensor_name
from palpate.report.tables import INFORMED

TOGETHER = "all"
JOINT, ONE = "direct_joint", "direct"
ONE_SECOND_S = 1.0
NEO_HOOKEAN = "neo_hookean"


def direct_rows(
    captures: Sequence[Mapping],
    singles: Sequence[Mapping],
    groups: Sequence[Mapping],
    joints: Sequence[Mapping],
) -> pd.DataFrame:
    """Direct estimates, one row for each capture and each object and sensor.

    The recommended row of an object and a sensor is the estimate from all its captures together;
    of an object with one capture they are the same.

    Parameters
    ----------
    captures, singles : sequences of mapping
        Described captures and their direct.json.
    groups, joints : sequences of mapping
        ``object, sensor, provenance`` and the direct.json of all captures of each.

    Returns
    -------
    DataFrame
    """
    singles, joints = compared(captures, singles, groups, joints)
    rows = [
        _row(capture, found, method=ONE, recommended=False)
        for capture, found in zip(captures, singles, strict=True)
    ]
    for group, found in zip(groups, joints, strict=True):
        known = {"capture": TOGETHER, "point": TOGETHER} | dict(group)
        rows.append(_row(known, found, method=JOINT, recommended=True))
    return pd.DataFrame(rows)


def compared(
    captures: Sequence[Mapping],
    singles: Sequence[Mapping],
    groups: Sequence[Mapping],
    joints: Sequence[Mapping],
) -> tuple[list[dict], list[dict]]:
    """Singles and joints with what those of the same object say against them (`exclusions`).

    Nothing is identified of a joint estimate that others speak against.
    """
    of, found = [*captures, *groups], [*map(dict, singles), *map(dict, joints)]
    for name in {each["object"] for each in groups}:
        mine = [k for k, each in enumerate(of) if each["object"] == name]
        said = exclusions([_estimated(of[k], found[k], joint=k >= len(captures)) for k in mine])
        for k, lines in zip(mine, said, strict=True):
            if lines and k >= len(captures):
                moduli = {key: Modulus(**one) for key, one in found[k].items() if _is_modulus(one)}
                found[k] |= {key: asdict(one) for key, one in bounded_at_best(moduli).items()}
            found[k]["doubts"] = [*found[k]["doubts"], *lines]
    return found[: len(captures)], found[len(captures) :]


def _estimated(of: Mapping, found: Mapping, *, joint: bool) -> Estimated:
    which = "all captures" if joint else f"capture {of['capture']}"
    moduli = {name: Modulus(**found[name]) for name in LABELS}
    return Estimated(f"{which} by {sensor_name(of['sensor'])}", moduli, joint)


def _is_modulus(value: object) -> bool:
    return isinstance(value, Mapping) and "verdict" in value


def truth_of(material: Mapping) -> dict[str, float]:
    """True moduli of a material of the lab; material.json.

    ``youngs_modulus_pa`` is the instantaneous one, which no relaxation has lowered yet;
    ``youngs_modulus_1s_pa`` is what a step of strain leaves after a second;
    ``effective_reduced_modulus_pa`` is what is then left of E*, of a neo-Hookean material; not a
    number of others.
    """
    if {"skin", "gradient"} & set(material):
        # What is not the same everywhere has no one modulus.
        return dict.fromkeys(LABELS, float("nan"))
    E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
    star = E / (1 - nu**2)
    neo_hookean = material.get("law", NEO_HOOKEAN) == NEO_HOOKEAN
    relaxation = material.get("relaxation") or {"fractions": [], "times_s": []}
    share, tau = (np.array(relaxation[name], dtype=float) for name in ("fractions", "times_s"))
    left = 1 - float(share @ -np.expm1(-ONE_SECOND_S / tau)) if len(tau) else 1.0
    return {
        "youngs_modulus_pa": E,
        "poisson_ratio": nu,
        "reduced_modulus_pa": star,
        "effective_reduced_modulus_pa": star * left if neo_hookean else float("nan"),
        "youngs_modulus_1s_pa": E * left,
    }


def accuracy_table(rows: pd.DataFrame, materials: Mapping[str, Mapping]) -> pd.DataFrame:
    """Put the truth beside estimates of simulated captures.

    Parameters
    ----------
    rows : DataFrame
        Estimates of any method with columns of `direct_rows`.
    materials : mapping
        material.json by object.

    Returns
    -------
    DataFrame
        For each modulus ``true_<name>``, the error (relative, of nu absolute) and whether the
        interval covers the truth.
    """
    table = rows.copy()
    truths = pd.DataFrame([truth_of(materials[name]) for name in table["object"]])
    for name in LABELS:
        true = truths[name].to_numpy()
        found = pd.to_numeric(table[name]).to_numpy(dtype=float)
        table[f"true_{name}"] = true
        stem = name.removesuffix("_pa")
        table[f"{stem}_error"] = found - true if name == "poisson_ratio" else found / true - 1
        low, high = (pd.to_numeric(table[end]).to_numpy(dtype=float) for end in columns(name)[1:3])
        covers = pd.array((low <= true) & (true <= high), dtype="boolean")
        covers[~(np.isfinite(low) & np.isfinite(true))] = pd.NA
        table[f"{stem}_covered"] = covers
    first = ["object", "sensor", "point", "method", "youngs_modulus_pa", "true_youngs_modulus_pa"]
    first += ["poisson_ratio", "true_poisson_ratio"]
    return table[[*first, *(name for name in table.columns if name not in first)]]


def coverage_table(accuracy: pd.DataFrame) -> pd.DataFrame:
    """Errors and coverage of the intervals by object, sensor and method, and over all.

    Parameters
    ----------
    accuracy : DataFrame
        Of `accuracy_table`.
    """
    keys = ["object", "sensor", "method"]
    groups = [*accuracy.groupby(keys, sort=True)]
    groups += [
        (("all", sensor, method), part)
        for (sensor, method), part in accuracy.groupby(["sensor", "method"])
    ]
    groups += [(("all", "all", method), part) for method, part in accuracy.groupby("method")]
    rows = []
    for names, part in groups:
        row = dict(zip(keys, names, strict=True)) | {"runs": len(part)}
        for name in LABELS:
            stem = name.removesuffix("_pa")
            errors = part[f"{stem}_error"].dropna()
            covered = part[f"{stem}_covered"].dropna()
            row[f"{stem}_median_error"] = float(errors.median()) if len(errors) else None
            row[f"{stem}_rms_error"] = float(np.sqrt((errors**2).mean())) if len(errors) else None
            row[f"{stem}_coverage"] = float(covered.mean()) if len(covered) else None
        known = part["poisson_ratio_verdict"].dropna()
        row["poisson_ratio_identified"] = (
            float((known == IDENTIFIED).mean()) if len(known) else None
        )
        rows.append(row | {"provenance": part["provenance"].iloc[0]})
    return pd.DataFrame(rows)


def _row(capture: Mapping, found: Mapping, *, method: str, recommended: bool) -> dict:
    row = {name: capture[name] for name in ("object", "sensor", "capture", "point")}
    row |= {"method": method, "recommended": recommended}
    for name in LABELS:
        row |= Modulus(**found[name]).cells(name)
    for name in INFORMED:
        for kind, value in found["information"][name].items():
            row[f"{name.removesuffix('_pa')}_{kind}"] = value
    residuals = found["residuals"]
    row |= {
        "effective_depth_m": found["effective"]["depth_m"],
        "force_law": found["law"]["force"]["value"],
        "force_law_std": found["law"]["force"]["std"],
        "motion_law": found["law"]["motion"]["value"],
        "motion_law_std": found["law"]["motion"]["std"],
        "captures": len(found["captures"]),
        "frames": sum(found["frames"]),
        "motion_scale": float(np.median([r["motion_scale"] for r in residuals])),
        "motion_sharing": float(np.median([r["motion_sharing"] for r in residuals])),
        "depth_scale": float(np.median([r["depth_scale"] for r in residuals])),
    }
    if found["doubts"]:
        row["doubts"] = "; ".join(found["doubts"])
    return row | {"provenance": capture["provenance"]}
