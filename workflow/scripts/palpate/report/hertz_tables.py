"""Tables of Section 5.1: repeated presses, the block's points, and Hertz models against truth."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from palpate.estimate.relaxation import relaxed_share
from palpate.modulus import NOT_JUDGED
from palpate.report.tables import CAPTURE

ROWS_OF_BLOCK = 3
# Table 5.1 is of one sensor and point.
PUBLISHED_ATTEMPTS = {"sensor": "kinect", "point": "11"}
MODULI = [
    "reduced_modulus_pa",
    "free_contact_reduced_modulus_pa",
    "recommended_reduced_modulus_pa",
]
SPREAD = {"mean": lambda x: x.mean(), "standard deviation (n-1)": lambda x: x.std(ddof=1)}
FEWEST_FOR_CORRELATION = 3
LATER = [
    "later_reduced_modulus_pa",
    "later_low_pa",
    "later_high_pa",
    "true_later_reduced_modulus_pa",
    "later_ratio",
    "later_covers",
]
MODEL = ["indenter", "support", "contact", "relaxation"]


def hertz_table(captures: Sequence[Mapping], fits: Sequence[Mapping]) -> pd.DataFrame:
    """Hertz fits of all captures, one row each.

    Parameters
    ----------
    captures : sequence of mapping
        ``object, sensor, capture, point, provenance`` of each capture.
    fits : sequence of mapping
        hertz.json of each capture.

    Returns
    -------
    DataFrame
        Reduced moduli [Pa] of the study's fit, of the fit with the contact point free and of the
        recommended model, the latter two with their 95 % intervals; ``recommended_verdict`` is
        *not judged* where something speaks against its law.
    """
    rows = []
    for capture, fit in zip(captures, fits, strict=True):
        values = {name: capture[name] for name in CAPTURE}
        values["reduced_modulus_pa"] = fit["study"]["reduced_modulus_pa"]
        for name in ("free_contact", "recommended"):
            low, high = fit[name]["reduced_modulus_interval_pa"]
            values[f"{name}_reduced_modulus_pa"] = fit[name]["reduced_modulus_pa"]
            values |= {f"{name}_low_pa": low, f"{name}_high_pa": high}
        doubtful = len(fit["recommended"]["doubts"]) > 0
        values["recommended_verdict"] = NOT_JUDGED if doubtful else None
        rows.append(values | {"provenance": capture["provenance"]})
    return pd.DataFrame(rows)


def table_5_1(hertz: pd.DataFrame, published: pd.DataFrame) -> pd.DataFrame:
    """Reduced modulus of each attempt, with mean and standard deviation, beside Table 5.1.

    Parameters
    ----------
    hertz : DataFrame
        Of `hertz_table`, attempts alone.
    published : DataFrame
        config/published/table_5_1.csv.

    Returns
    -------
    DataFrame
        One row for each attempt, then ``mean`` and ``standard deviation (n-1)``, per sensor and
        point.
    """
    ours = hertz.copy()
    ours["attempt"] = ours["capture"].str.extract(r"(\d+)$", expand=False).astype(int)
    printed = published.rename(columns={"reduced_modulus_pa": "published_reduced_modulus_pa"})
    printed = printed.assign(**PUBLISHED_ATTEMPTS)
    ours = ours.merge(printed, on=["sensor", "point", "attempt"], how="left")
    values = [*MODULI, "published_reduced_modulus_pa"]
    columns = ["sensor", "point", "attempt", *values, "provenance"]
    parts = []
    for (sensor, point), group in ours.sort_values("attempt").groupby(["sensor", "point"]):
        known = {"sensor": sensor, "point": point, "provenance": group["provenance"].iloc[0]}
        ends = [
            known | {"attempt": name} | {column: spread(group[column]) for column in values}
            for name, spread in SPREAD.items()
        ]
        parts += [group[columns].astype(object), pd.DataFrame(ends)[columns].astype(object)]
    return pd.concat(parts, ignore_index=True)


def table_5_2(hertz: pd.DataFrame, published: pd.DataFrame, *, block: str) -> pd.DataFrame:
    """Reduced modulus at the block's points beside Table 5.2.

    Parameters
    ----------
    hertz : DataFrame
        Of `hertz_table`.
    published : DataFrame
        config/published/table_5_2.csv.
    block : str
        Name of the study's block; other objects have no row here.

    Returns
    -------
    DataFrame
        One row for each capture that is the only one of its point.
    """
    ours = hertz[(hertz["object"] == block) & (hertz["capture"] == hertz["point"])].copy()
    ours["point"] = ours["point"].astype(int)
    ours["row"] = (ours["point"] - 1) % ROWS_OF_BLOCK + 1
    ours["column"] = (ours["point"] - 1) // ROWS_OF_BLOCK + 1
    printed = published[["sensor", "point", "reduced_modulus_pa"]].rename(
        columns={"reduced_modulus_pa": "published_reduced_modulus_pa"}
    )
    merged = ours.merge(printed, on=["sensor", "point"], how="left")
    first = ["sensor", "point", "row", "column", "reduced_modulus_pa"]
    middle = [
        f"{name}_{end}"
        for name in ("free_contact", "recommended")
        for end in ("reduced_modulus_pa", "low_pa", "high_pa")
    ]
    last = ["published_reduced_modulus_pa", "provenance"]
    return merged.sort_values(["sensor", "point"])[first + middle + last].reset_index(drop=True)


def pattern_correlation(table: pd.DataFrame) -> pd.DataFrame:
    """How far the points' moduli go up and down with the published ones.

    Parameters
    ----------
    table : DataFrame
        Of `table_5_2`.

    Returns
    -------
    DataFrame
        Pearson's and Spearman's correlation of each kind of modulus, per sensor and for both;
        empty cells where fewer than three points have a published value.
    """
    known = table.dropna(subset=["published_reduced_modulus_pa"])
    groups = [*known.groupby("sensor"), ("all", known)]
    rows = []
    for sensor, group in groups:
        for name in MODULI:
            row = {"sensor": sensor, "modulus": name.removesuffix("_pa"), "points": len(group)}
            for method in ("pearson", "spearman"):
                row[method] = _correlation(group, name, method)
            rows.append(row | {"provenance": "/".join(sorted(set(group["provenance"])))})
    return pd.DataFrame(rows)


def accuracy_table(
    captures: Sequence[Mapping], fits: Sequence[Mapping], materials: Mapping[str, Mapping]
) -> pd.DataFrame:
    """Every model of every capture against the true reduced modulus.

    Parameters
    ----------
    captures : sequence of mapping
    fits : sequence of mapping
        hertz.json of each capture.
    materials : mapping
        material.json by object.

    Returns
    -------
    DataFrame
        One row per capture and model; ``ratio`` of found and true instantaneous E*, whether the
        interval ``covers`` the truth, the same some time after a step (``later``) for models that
        allow for relaxation, and which model is the ``recommended`` one.
    """
    rows = []
    for capture, fit in zip(captures, fits, strict=True):
        material = materials[capture["object"]]
        true = material["reduced_modulus_pa"]
        chosen = [fit["recommended"][name] for name in MODEL]
        for model in fit["models"]:
            rows.append(
                {name: capture[name] for name in CAPTURE}
                | {name: model[name] for name in MODEL}
                | _against(model["reduced_modulus_pa"], model["reduced_modulus_interval_pa"], true)
                | {"true_relaxed_reduced_modulus_pa": relaxed_modulus(material)}
                | _later_against(model, material)
                | {
                    "recommended": [model[name] for name in MODEL] == chosen,
                    "provenance": capture["provenance"],
                }
            )
    return pd.DataFrame(rows)


def _against(found: float, interval: Sequence[float], true: float) -> dict:
    low, high = interval
    return {
        "reduced_modulus_pa": found,
        "low_pa": low,
        "high_pa": high,
        "true_reduced_modulus_pa": true,
        "ratio": round(found / true, 4),
        "covers": low <= true <= high,
    }


def _later_against(model: Mapping, material: Mapping) -> dict:
    """Modulus after a while against the truth; empty for a model that knows of none."""
    if "later_s" not in model:
        return {"later_s": np.nan} | dict.fromkeys(LATER, np.nan)
    after = model["later_s"]
    found, interval = model["later_reduced_modulus_pa"], model["later_reduced_modulus_interval_pa"]
    against = _against(found, interval, relaxed_modulus(material, after))
    return {"later_s": after} | dict(zip(LATER, against.values(), strict=True))


def relaxed_modulus(material: Mapping, after_s: float = np.inf) -> float:
    """Reduced modulus that is left some time after a step, or in the end [Pa]; material.json."""
    terms = material.get("relaxation", {"fractions": [], "times_s": []})
    return material["reduced_modulus_pa"] * float(1 - relaxed_share(after_s, **terms))


def accuracy_summary(accuracy: pd.DataFrame) -> pd.DataFrame:
    """Per sensor and model: median ratio, its spread, and the share of intervals that cover.

    The truth is the instantaneous E*; the ratio to what is left when it has relaxed stands beside,
    and, for models that allow for relaxation, the modulus a stated time after a step.
    The study's fit is the paraboloid on a half-space with known contact. Rows of the recommended
    models, whichever they are, come last.
    """
    ours = accuracy[accuracy["recommended"]].assign(**dict.fromkeys(MODEL, "recommended"))
    keys = ["object", "sensor", *MODEL]
    rows = []
    for part in (accuracy, ours):
        for names, group in part.groupby(keys, sort=False):
            ratio = group["ratio"]
            relaxed = group["reduced_modulus_pa"] / group["true_relaxed_reduced_modulus_pa"]
            rows.append(
                dict(zip(keys, names, strict=True))
                | {
                    "captures": len(group),
                    "median_ratio": round(float(ratio.median()), 4),
                    "median_ratio_to_relaxed": round(float(relaxed.median()), 4),
                    "ratio_standard_deviation": round(float(ratio.std(ddof=1)), 4),
                    "share_of_intervals_that_cover": round(float(group["covers"].mean()), 3),
                    "median_later_ratio": round(float(group["later_ratio"].median()), 4),
                    "share_of_later_intervals_that_cover": round(
                        float(group["later_covers"].astype(float).mean()), 3
                    ),
                    "provenance": group["provenance"].iloc[0],
                }
            )
    table = pd.DataFrame(rows)
    return table.sort_values(["object", "sensor"], kind="stable").reset_index(drop=True)


def _correlation(group: pd.DataFrame, name: str, method: str) -> float | None:
    one, other = (group[column].astype(float) for column in (name, "published_reduced_modulus_pa"))
    if len(group) < FEWEST_FOR_CORRELATION or np.ptp(one) == 0 or np.ptp(other) == 0:
        return None
    if method == "spearman":
        one, other = one.rank(), other.rank()
    return round(float(np.corrcoef(one, other)[0, 1]), 3)
