"""Rows of a summary: what each method found of each object, sensor and capture."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict

import numpy as np
import pandas as pd

from palpate.estimate.direct.warnings import Estimated, exclusions
from palpate.modulus import BOUNDED, INTERVAL, LABELS, NOT_JUDGED, Modulus, bounded_at_best, columns
from palpate.point_map import FEWEST_POINTS, homogeneity, own_stds, point_moduli
from palpate.report.style import sensor_name
from palpate.report.tables import CAPTURE, JUDGED
from palpate.units import PERCENT

STAR = "reduced_modulus_pa"
# Of these a summary says how well what was compared could tell them.
INFORMED = ("effective_reduced_modulus_pa", "youngs_modulus_pa", "poisson_ratio")
# Of the direct estimate: depth of the effective modulus, the law, captures and frames in it,
# residuals over what was stated, information limit.
LAWS = ("force_law", "force_law_std", "motion_law", "motion_law_std")
SCALES = ("motion_scale", "motion_sharing", "depth_scale")
# Of a joint estimate: points whose effective E* is compared, and whether they differ.
HOMOGENEITY = ("points", "homogeneity_p", "heterogeneity_percent", "heterogeneity_high_percent")
COLUMNS = [
    *CAPTURE,
    "method",
    "recommended",
    *(column for name in LABELS for column in columns(name)),
    "youngs_modulus_std_pa",
    "poisson_ratio_std",
    "poisson_ratio_reason",
    "at_bound",
    "effective_depth_m",
    *LAWS,
    "captures",
    "frames",
    *SCALES,
    *(f"{n.removesuffix('_pa')}_{kind}" for n in INFORMED for kind in ("bound", "efficiency")),
    *HOMOGENEITY,
    "warnings",
    "provenance",
]
# Method of an estimate from all captures of an object and a sensor.
JOINT = "direct_joint"


def row(known: Mapping, method: str, moduli: Mapping[str, Modulus], **more: object) -> dict:
    """One row: what it is of, by which method, each modulus with its interval and verdict.

    Of ``object, sensor, capture, point, provenance``, the moduli by the column of the value, and
    further columns.
    """
    found = {name: known[name] for name in CAPTURE} | {"method": method}
    for name, one in moduli.items():
        found |= one.cells(name)
    return found | more | {"provenance": known["provenance"]}


def summary(rows: Sequence[Mapping]) -> pd.DataFrame:
    """One row for each object, sensor, capture and method, and for all captures together.

    Intervals are at 95 %. A modulus without one has the verdict ``not judged``. Columns of a `row`
    that are none of a summary's are left out.
    """
    whole = pd.DataFrame(rows, columns=COLUMNS, dtype=object)
    whole["recommended"] = whole["recommended"].fillna(False).astype(bool)
    for name in JUDGED:
        _, low, _, verdict = columns(name)
        unjudged = whole[name].notna() & whole[verdict].isna()
        told = np.where(whole.loc[unjudged, low].notna(), INTERVAL, NOT_JUDGED)
        whole.loc[unjudged, verdict] = told
    return whole.sort_values([*CAPTURE, "method"]).reset_index(drop=True)


def hertz_rows(captures: Sequence[Mapping], fits: Sequence[Mapping]) -> Iterator[dict]:
    """Rows of the hertz.json of captures: depth as recorded, contact point free, recommended.

    E* of the recommended model is *not judged* where something speaks against its law.
    """
    for capture, fit in zip(captures, fits, strict=True):
        plain = Modulus(fit["study"][STAR], None, None, None, "Pa")
        yield row(capture, "hertz", {STAR: plain})
        for name in ("free_contact", "recommended"):
            found = fit[name]
            verdict = NOT_JUDGED if name == "recommended" and found["warnings"] else None
            ends = found["reduced_modulus_interval_pa"]
            yield row(capture, f"hertz_{name}", {STAR: Modulus(found[STAR], *ends, verdict, "Pa")})


def curve_rows(curves: Sequence[Mapping], found: Sequence[Mapping]) -> Iterator[dict]:
    """Two rows of each described curve's curve.json: E* by Hertz, and E for the declared nu."""
    for curve, one in zip(curves, found, strict=True):
        hertz, warnings = one["hertz"], one["warnings"]
        ends = hertz["reduced_modulus_interval_pa"]
        yield row(curve, "curve_hertz", {STAR: Modulus(hertz[STAR], *ends, None, "Pa")})
        # Of what may have been read or fitted otherwise an interval says too little.
        judged = {"youngs_modulus_verdict": BOUNDED, "reduced_modulus_verdict": BOUNDED}
        yield row(
            curve,
            "curve_table",
            {name: Modulus(**modulus) for name, modulus in one["moduli"].items()},
            **(judged if warnings else {}),
            recommended=True,
            captures=1,
            poisson_ratio_reason="a curve does not determine it",
            warnings="; ".join(warnings),
            **{name: one[name] for name in LAWS[:2]},
        )


def direct_rows(
    captures: Sequence[Mapping],
    singles: Sequence[Mapping],
    groups: Sequence[Mapping],
    joints: Sequence[Mapping],
) -> Iterator[dict]:
    """Direct estimates, one row for each capture and each object and sensor.

    The recommended row of an object and a sensor is the estimate from all its captures together; of
    an object with one capture they are the same. Singles are the direct.json of described captures,
    joints those of all captures of each group (``object, sensor, provenance``).
    """
    singles, joints = compared(captures, singles, groups, joints)
    for capture, found in zip(captures, singles, strict=True):
        yield _direct_row(capture, "direct", found)
    by_point = points_by_group(captures, singles, groups)
    for group, found, points in zip(groups, joints, by_point, strict=True):
        known = {"capture": "all", "point": "all"} | dict(group)
        yield _direct_row(known, JOINT, found) | _homogeneity(points)


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
    estimated = []
    for k, (known, one) in enumerate(zip(of, found, strict=True)):
        joint = k >= len(captures)
        which = "all captures" if joint else f"capture {known['capture']}"
        name = f"{which} by {sensor_name(known['sensor'])}"
        estimated.append(Estimated(name, {key: Modulus(**one[key]) for key in LABELS}, joint))
    for name in {each["object"] for each in groups}:
        mine = [k for k, each in enumerate(of) if each["object"] == name]
        said = exclusions([estimated[k] for k in mine])
        for k, lines in zip(mine, said, strict=True):
            one = found[k]
            if lines and estimated[k].joint:
                judged = {
                    key: Modulus(**value)
                    for key, value in one.items()
                    if isinstance(value, Mapping) and "verdict" in value
                }
                one |= {key: asdict(value) for key, value in bounded_at_best(judged).items()}
            one["warnings"] = [*one["warnings"], *lines]
    return found[: len(captures)], found[len(captures) :]


def points_by_group(
    captures: Sequence[Mapping], singles: Sequence[Mapping], groups: Sequence[Mapping]
) -> Iterator[dict[str, tuple[Modulus, float]]]:
    """Of each group `point_moduli`, of its captures and their direct.json."""
    for group in groups:
        mine = of_group(group, captures, singles)
        yield point_moduli(*zip(*mine, strict=True)) if mine else {}


def of_group(
    group: Mapping, captures: Sequence[Mapping], singles: Sequence[Mapping]
) -> list[tuple[Mapping, Mapping]]:
    """Captures of a group's object and sensor, each with its direct.json."""
    return [
        (capture, single)
        for capture, single in zip(captures, singles, strict=True)
        if all(capture[name] == group[name] for name in ("object", "sensor"))
    ]


def _homogeneity(points: Mapping[str, tuple[Modulus, float]]) -> dict[str, float]:
    """Columns of whether points differ, which takes three of them."""
    if len(points) < FEWEST_POINTS:
        return {"points": len(points)}
    moduli, parts = zip(*points.values(), strict=True)
    found = homogeneity(np.log([one.value for one in moduli]), own_stds(moduli, parts))
    deviations = PERCENT * found.deviation, PERCENT * found.deviation_high
    return dict(zip(HOMOGENEITY, (len(points), found.p_value, *deviations), strict=True))


def _direct_row(known: Mapping, method: str, found: Mapping) -> dict:
    informed = {
        f"{name.removesuffix('_pa')}_{kind}": value
        for name in INFORMED
        for kind, value in found["information"][name].items()
    }
    told = {f"{kind}_law": found["law"][kind]["value"] for kind in ("force", "motion")}
    told |= {f"{kind}_law_std": found["law"][kind]["std"] for kind in ("force", "motion")}
    residuals = {name: float(np.median([r[name] for r in found["residuals"]])) for name in SCALES}
    return row(
        known,
        method,
        {name: Modulus(**found[name]) for name in LABELS},
        recommended=method == JOINT,
        effective_depth_m=found["effective"]["depth_m"],
        captures=len(found["captures"]),
        frames=sum(found["frames"]),
        **told,
        **residuals,
        **informed,
        **({"warnings": "; ".join(found["warnings"])} if found["warnings"] else {}),
    )
