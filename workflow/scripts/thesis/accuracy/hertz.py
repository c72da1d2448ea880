"""Hertz models of all simulated captures against the lab's true reduced modulus."""

from typing import Any

from palpate.json_fields import read_all, read_by_folder
from palpate.report import hertz_tables, tables

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


def make_hertz_accuracy(inputs: Any, params: Any) -> dict:
    """All rows, and those of each sensor and model."""
    fits = read_all(inputs.fits)
    whole = hertz_tables.accuracy_table(params.captures, fits, read_by_folder(inputs.materials))
    short = hertz_tables.accuracy_summary(whole)
    text = tables.markdown(short, title=TITLE, more_notes=NOTES)
    return {"csv": tables.rounded(whole), "summary": short, "md": text}
