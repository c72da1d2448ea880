"""Every figure of people's own objects: a rule for each entry."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from palpate.report import texts
from palpate.workflow.own_objects import OwnObjects

TEXTS = texts("figures")


@dataclass(frozen=True)
class OwnFigure:
    """One figure of each object.

    Its name is that of its files, and after ``own_`` its rule's. In the report the object's name
    goes before the title; the caption stands there and on the object's page. ``make`` is
    ``module:function``, and takes the rule's inputs and params: files and values by name, of a
    run's objects.
    """

    name: str
    title: str
    caption: str
    make: str
    inputs: Callable[[OwnObjects], Mapping[str, Any]]
    params: Callable[[OwnObjects], Mapping[str, Any]]

    def rule_params(self, own: OwnObjects) -> dict:
        """Params of its rule."""
        known = {"make": self.make, "title": self.title, "caption": self.caption}
        return known | self.params(own)

    def rule_outputs(self, own: OwnObjects, report: Callable, caption: str) -> dict:
        """Outputs of its rule; the picture is put into the report with a caption's template."""
        labels = {"Result": f"{{object}}: {self.title}"}
        png, svg = (own.run.results(f"{{object}}/figures/{self.name}.{e}") for e in ("png", "svg"))
        marks = {"caption": caption, "category": "Other objects", "labels": labels}
        return {"png": report(png, **marks), "svg": svg}


def _all(own: OwnObjects) -> dict:
    return {"captures": own.captures, "groups": own.groups}


def _tracked(own: OwnObjects) -> dict:
    return {
        "tracked": own.files(own.first, f"tracked-{own.run.tracker}.npz"),
        "clouds": own.files(own.first, "clouds.npz"),
        "fits": own.files(own.first, "hertz.json"),
        "recorded": own.recorded(own.first),
    }


# Of a figure that stands elsewhere on the page, and of one that is on it alone.
HERTZ, MAPPED = "hertz_fit", "map"
OWN_FIGURES = (
    OwnFigure(
        "moduli",
        **TEXTS["moduli"],
        make="palpate.report.moduli_figure:make_moduli",
        inputs=lambda own: {"direct": own.files(own.captures, "direct.json"), "joint": own.joint()},
        params=_all,
    ),
    OwnFigure(
        HERTZ,
        **TEXTS[HERTZ],
        make="palpate.report.hertz_figures:make_hertz_fits",
        inputs=lambda own: {"fits": own.files(own.fitted, "hertz.json")},
        params=lambda own: {"captures": own.fitted},
    ),
    OwnFigure(
        "fit",
        **TEXTS["fit"],
        make="palpate.report.fitted_figures:make_fit",
        inputs=lambda own: {"fitted": own.joint("fitted.npz")},
        params=_all,
    ),
    OwnFigure(
        "known",
        **TEXTS["known"],
        make="palpate.report.fitted_figures:make_known",
        inputs=lambda own: {"joint": own.joint(), "fitted": own.joint("fitted.npz")},
        params=_all,
    ),
    OwnFigure(
        "surface",
        **TEXTS["surface"],
        make="palpate.report.surface_figures:make_tracked_surface",
        inputs=_tracked,
        params=lambda own: {"captures": own.first, "sensors": own.sensors},
    ),
)
