"""Every figure of people's own objects: a rule for each entry."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from palpate.workflow.own_objects import OwnObjects


@dataclass(frozen=True)
class OwnFigure:
    """One figure of each object.

    Its name is that of its files, and after ``own_`` its rule's. In the report the object's name
    goes before the title, and the caption is reStructuredText. ``make`` is ``module:function``, and
    takes the rule's inputs and params: files and values by name, of a run's objects.
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


OWN_FIGURES = (
    OwnFigure(
        "moduli",
        title="E and nu",
        caption="Direct estimates straight from clouds and forces, with 95 % intervals: of each"
        " capture, and of all captures with a sensor together (diamonds, the recommended"
        " estimate). The value of an open symbol is not to be trusted; its interval is.",
        make="palpate.report.own_moduli:make_own_moduli",
        inputs=lambda own: {"direct": own.files(own.captures, "direct.json"), "joint": own.joint()},
        params=_all,
    ),
    OwnFigure(
        "hertz_fit",
        title="Hertz fit",
        caption="Hertz model (Eq. 5.1) fitted to force (N) and depth (mm) of the first captures,"
        " with a contact point that is free beside it, and what both leave (mN).",
        make="palpate.report.hertz_figures:make_hertz_fits",
        inputs=lambda own: {"fits": own.files(own.fitted, "hertz.json")},
        params=lambda own: {"captures": own.fitted},
    ),
    OwnFigure(
        "fit",
        title="What was seen and computed",
        caption="Force (N) against depth (mm) and motion of the surface (mm) against distance"
        " (mm), seen and computed with the recommended estimate, and the residuals of both.",
        make="palpate.report.fitted_figures:make_fit",
        inputs=lambda own: {"fitted": own.joint("fitted.npz")},
        params=_all,
    ),
    OwnFigure(
        "known",
        title="What is known of E, nu and the law",
        caption="E (kPa) and nu that the tip's depth alone, the surface alone and both explain (95"
        " %), how likely each place between the laws is, and E over the time after a step, dashed"
        " later than the captures.",
        make="palpate.report.fitted_figures:make_known",
        inputs=lambda own: {"joint": own.joint(), "fitted": own.joint("fitted.npz")},
        params=_all,
    ),
    OwnFigure(
        "surface",
        title="Tracked surface",
        caption="What the camera sees in the deepest frame of the first capture with each sensor,"
        " the tracked surface, and a section through the dent (mm).",
        make="palpate.report.surface_figures:make_tracked_surface",
        inputs=_tracked,
        params=lambda own: {"captures": own.first, "sensors": own.sensors},
    ),
)
