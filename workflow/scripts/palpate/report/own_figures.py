"""Every figure of people's own objects: a rule for each entry."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from palpate.workflow.own_objects import OwnObjects


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


HERTZ = "hertz_fit"
OWN_FIGURES = (
    OwnFigure(
        "moduli",
        title="E and nu",
        caption="Moduli of each capture and of all captures with a sensor together (diamonds, the"
        " recommended estimate): lines are 95 % intervals. Intervals that overlap agree. Where a"
        " symbol is hollow the value is not identified: rely on its interval.",
        make="palpate.report.moduli_figure:make_moduli",
        inputs=lambda own: {"direct": own.files(own.captures, "direct.json"), "joint": own.joint()},
        params=_all,
    ),
    OwnFigure(
        HERTZ,
        title="Hertz fit",
        caption="Force against depth in the first captures, with Hertz's law for a ball on a"
        " half-space, F = 4/3 E* R^(1/2) d^(3/2) (Eq. 5.1; R: radius of the ball, d: depth), with a"
        " contact point that is known and one that is fitted, and the residuals of both. Residuals"
        " in a bow say that the object is no half-space: the recommended estimate allows for that,"
        " this fit does not.",
        make="palpate.report.hertz_figures:make_hertz_fits",
        inputs=lambda own: {"fits": own.files(own.fitted, "hertz.json")},
        params=lambda own: {"captures": own.fitted},
    ),
    OwnFigure(
        "fit",
        title="Measured and computed",
        caption="Left: force against indentation depth, measured and computed with the recommended"
        " moduli. Right: displacement of the surface along its normal at maximum depth, over the"
        " distance from the contact. Below: residuals, most of which should be in the grey band,"
        " where 95 % of them are expected.",
        make="palpate.report.fitted_figures:make_fit",
        inputs=lambda own: {"fitted": own.joint("fitted.npz")},
        params=_all,
    ),
    OwnFigure(
        "known",
        title="What determines E, nu and the law",
        caption="Left: pairs of E and nu that explain the indentation depth, the surface"
        " displacement, and both: joint regions of 95 %, without the errors of rig and mesh that"
        " the intervals above contain. Middle: how likely each material-law parameter of the force"
        " is. Right: how E relaxes after a step, with 95 % intervals; dashed and hollow later than"
        " what was recorded.",
        make="palpate.report.fitted_figures:make_known",
        inputs=lambda own: {"joint": own.joint(), "fitted": own.joint("fitted.npz")},
        params=_all,
    ),
    OwnFigure(
        "surface",
        title="Tracked surface",
        caption="Maximum depth of the first capture with each sensor: the camera's picture, and a"
        " section through the contact. Away from the probe, line and points should coincide.",
        make="palpate.report.surface_figures:make_tracked_surface",
        inputs=_tracked,
        params=lambda own: {"captures": own.first, "sensors": own.sensors},
    ),
)
