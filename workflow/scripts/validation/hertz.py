"""Hertz models of all simulated captures against the lab's true reduced modulus."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from palpate.json_fields import read_all, read_by_folder
from palpate.report import tables
from validation.measured import relaxed_part

TITLE = "Hertz models against the virtual lab's truth"
NOTES = (
    "The truth of median_ratio and of the intervals is the instantaneous E*, that of the later"
    " columns E* the time later_s after a step (hertz.relaxation.at_s)."
    " The material relaxes while it is pressed: models with relaxation prony allow for it and for"
    " finite strain, leave Poisson's ratio open, and their intervals hold the stated errors of"
    " depth, force and contact law."
    " Intervals of the others cover scatter and the stated error of the depth alone."
    " The study's fit is the parabola on a half-space with known contact.",
)
MODEL = ["indenter", "support", "contact", "relaxation"]
STATISTICS = {
    "captures": ("ratio", "size"),
    "median_ratio": ("ratio", "median"),
    "median_ratio_to_relaxed": ("ratio_to_relaxed", "median"),
    "ratio_standard_deviation": ("ratio", "std"),
    "share_of_intervals_that_cover": ("covers", "mean"),
    "median_later_ratio": ("later_ratio", "median"),
    "share_of_later_intervals_that_cover": ("later_covers", "mean"),
    "provenance": ("provenance", "first"),
}
PLACES = {name: 3 if name.startswith("share") else 4 for name in (*STATISTICS,)[1:-1]}


def make_hertz_accuracy(inputs: Any, params: Any) -> dict:
    """All rows, and those of each sensor and model."""
    fits = read_all(inputs.fits)
    whole = accuracy_table(params.captures, fits, read_by_folder(inputs.materials))
    short = accuracy_summary(whole)
    text = tables.markdown(short, title=TITLE, more_notes=NOTES)
    return {"csv": tables.rounded(whole), "summary": short, "md": text}


def accuracy_table(
    captures: Sequence[Mapping], fits: Sequence[Mapping], materials: Mapping[str, Mapping]
) -> pd.DataFrame:
    """Every model of every capture (hertz.json) against the true reduced modulus (material.json).

    One row per capture and model; ``ratio`` of found and true instantaneous E*, whether the
    interval ``covers`` the truth, the same some time after a step (``later``) for models that allow
    for relaxation, and which model is the ``recommended`` one.
    """
    rows = []
    for capture, fit in zip(captures, fits, strict=True):
        material = materials[capture["object"]]
        star = material["reduced_modulus_pa"]
        for model in fit["models"]:
            row = {name: capture[name] for name in tables.CAPTURE}
            row |= {name: model[name] for name in MODEL} | _against(model, "", star)
            row["true_relaxed_reduced_modulus_pa"] = star * relaxed_part(material)
            row["later_s"] = after = model.get("later_s", np.nan)
            row |= _against(model, "later_", star * relaxed_part(material, after))
            row["recommended"] = all(model[name] == fit["recommended"][name] for name in MODEL)
            rows.append(row | {"provenance": capture["provenance"]})
    return pd.DataFrame(rows)


def accuracy_summary(accuracy: pd.DataFrame) -> pd.DataFrame:
    """Per sensor and model: median ratio, its spread, and the share of intervals that cover.

    The truth is the instantaneous E*; the ratio to what is left when it has relaxed stands beside,
    and, for models that allow for relaxation, the modulus a stated time after a step. Rows of the
    recommended models, whichever they are, come last.
    """
    relaxed = accuracy["reduced_modulus_pa"] / accuracy["true_relaxed_reduced_modulus_pa"]
    later = accuracy["later_covers"].astype(float)
    table = accuracy.assign(ratio_to_relaxed=relaxed, later_covers=later)
    ours = table[table["recommended"]].assign(**dict.fromkeys(MODEL, "recommended"))
    groups = pd.concat([table, ours]).groupby(["object", "sensor", *MODEL], sort=False)
    short = groups.agg(**STATISTICS).reset_index()
    for name, places in PLACES.items():
        short[name] = [round(value, places) for value in short[name]]
    return short.sort_values(["object", "sensor"], kind="stable", ignore_index=True)


def _against(model: Mapping, when: str, true: float) -> dict:
    """What a model has of modulus, interval, truth, their ratio and whether that is covered."""
    ends = [f"{when}low_pa", f"{when}high_pa"]
    names = [f"{when}reduced_modulus_pa", *ends, f"true_{when}reduced_modulus_pa"]
    names += [f"{when}ratio", f"{when}covers"]
    if names[0] not in model:
        return dict.fromkeys(names, np.nan)
    found, (low, high) = model[names[0]], model[f"{when}reduced_modulus_interval_pa"]
    cells = found, low, high, true, round(found / true, 4), low <= true <= high
    return dict(zip(names, cells, strict=True))
