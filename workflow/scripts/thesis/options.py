"""The study's configuration; ``-m thesis.options PAGE`` writes the page of the tool's."""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from palpate.capture.files import whole_file
from palpate.config.model import Count, FileName, Model, Positive, all_different, option
from palpate.workflow.options import Config, Experiments, Tracking, page, partly
from pydantic import BeforeValidator, model_validator

from thesis.minimise.options import Load, Minimise, Solid
from thesis.run import StudyRun
from thesis.tracker.options import TRACKERS, Registration, tracker_problems

BOTH_TRACKERS = {name: {"kind": name} for name in TRACKERS}
Tracker = partly(*TRACKERS.values(), like=str, kind=Literal[tuple(TRACKERS)])
Step = partly(Load, Solid, tracker=str)
# Captures by object and sensor.
Captures = dict[str, dict[str, tuple[str, ...]]]


class Study(Model):
    """Of the lab's recordings, those that tables and figures use."""

    captures: Captures = option({}, "those of the run")
    tracked: Captures = option({}, "of these, those that are tracked and minimised")
    direct: Captures = option({}, "estimated directly, where they are not the tracked")
    block: str = option("", "the object of Tables 5.2 and 5.3")
    table_5_3_points: Annotated[tuple[str, ...], all_different] = option((), "of Table 5.3")
    figure_points: dict[str, str] = option({}, "of figures; else the first")


class SimulatedSupport(Model):
    """What the simulated block is held by."""

    plane_point_m: tuple[float, float, float] = option((0, 0, 0), "of the support")
    plane_normal: tuple[float, float, float] = option((0, 0, 1), "of the support")
    tolerance_m: Positive = option(1.0e-6, "of nodes from it")


class SimulatedRegistration(Registration):
    """Registration of the block, by tracking error (tables/simulation_tracking.md).

    The error no longer falls with w_sm_stop.
    """

    w_sm: Positive = option(0.5, "first weight of the smoothness")
    w_sm_stop: Positive = option(
        0.01, "edges are 40 mm: more smoothness flattens a dent of three vertices"
    )
    data_term: Literal["point", "plane"] = option(
        "point", "Eq. 4.25 as printed; along the normal alone, sideways motion stays unseen"
    )
    data_points: Literal["nearest", "mean"] = option("nearest", "as printed: there is no noise")
    largest_normal_deg: float = option(
        90, "a box's corner and its sides are 55 degrees apart", gt=0, le=180
    )
    coarsest_vertices: Count = option(1000, "of the hierarchy, as printed", ge=1)


class Points(Model):
    """Points on the simulated surface."""

    cuts: int = option(60, "of an edge: 0.5 to 0.9 mm apart, a step is 0.3 mm", ge=1, le=200)
    corners: bool = option(True, "the moved vertices are among the points, as in the study")


class LinearMethod(Model):
    """The linear method (Section 3.3.2)."""

    starts_pa: tuple[tuple[Positive, Positive], ...] = option(
        ((1000, 1000), (10000, 50000), (50000, 10000), (200000, 20000), (1000000, 1000000)),
        "lambda and mu",
        min_length=1,
    )
    iterations: Count = option(500, "at most", ge=1)
    tolerance: Positive = option(1.0e-9, "relative change of (lambda, mu)")


class Noise(Model):
    """Noise on the exact displacements."""

    std_m: tuple[Positive, ...] = option(
        (1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3), "its deviations", min_length=1
    )
    repeats: Count = option(5, "draws of each", ge=1)


Variant = partly(Points, SimulatedRegistration)


class Simulation(Points):
    """The simulated block (Sections 3.3.2 to 3.3.4)."""

    support: SimulatedSupport = option(SimulatedSupport(), "of the block")
    tracking: SimulatedRegistration = option(SimulatedRegistration(), "of its surface")
    variants: dict[FileName, Variant] = option(
        {}, "of the above, to show what the estimates owe to the tracker"
    )
    linear: LinearMethod = option(LinearMethod(), "Section 3.3.2")
    noise: Noise = option(Noise(), "on the exact displacements")


def _with_both(trackers: Any) -> Any:
    """Trackers by name, those of the two kinds among them."""
    if not (
        isinstance(trackers, Mapping) and all(isinstance(t, Mapping) for t in trackers.values())
    ):
        return trackers
    return {
        name: BOTH_TRACKERS.get(name, {}) | dict(trackers.get(name, {}))
        for name in {**BOTH_TRACKERS, **trackers}
    }


class Trackers(Tracking):
    """The template through a capture (Section 4.3)."""

    estimate_from: str = option("study", "the tracker whose surfaces are minimised")
    compared: Annotated[tuple[str, ...], all_different] = option(
        (), "trackers of every tracked capture"
    )
    trackers: Annotated[dict[FileName, Tracker], BeforeValidator(_with_both)] = option(
        {name: Tracker(**said) for name, said in BOTH_TRACKERS.items()},
        "by name: results tracked-<name>.npz; `like` takes over another one's options",
    )
    objects: dict[str, dict[str, Tracker]] = option(
        {}, "options of single objects, by object and tracker"
    )

    @model_validator(mode="after")
    def _that_can_be(self) -> Self:
        if lines := tracker_problems(self.written()):
            raise ValueError("\n".join(lines))
        return self


class Search(Minimise):
    """Error minimisation of a run."""

    steps: dict[FileName, Step] = option(
        {},
        "tables/minimise_steps: options of minimise and solid, or the tracker, changed in turn",
    )
    objects: dict[str, partly(Load)] = option({}, "load of single objects")


# Of docs/options.md, after the tool's.
OF_STUDY = """
## The study

`config/thesis.yaml` also has `study`, `error_options`, `solid`, `minimise`, `simulation`,
`tracking.trackers`, `.compared`, `.objects` and `.estimate_from`, and
`experiments.cd_case_size_m`; their defaults, bounds and meaning are in
`workflow/scripts/thesis/options.py`. With them `methods` may also name `minimise`, the study's
error minimisation, which takes minutes a capture and determines less.
"""


class StudyExperiments(Experiments):
    """Recordings about the sensors: raw/sensors/<sensor>/<experiment>."""

    cd_case_size_m: tuple[Positive, Positive, Positive] = option(
        (0.142, 0.124, 0.0104), "Section 4.2.4; a case's usual height"
    )


class StudyConfig(Config):
    """All that a run's configuration may say."""

    run: ClassVar[type[StudyRun]] = StudyRun
    study: Study = option(Study(), "of the lab's recordings")
    methods: Annotated[tuple[Literal["hertz", "direct", "minimise"], ...], all_different] = option(
        ("hertz", "direct"),
        "of people's own objects; a page needs the first two; minimise, the study's, takes minutes"
        " a capture and determines less",
        min_length=1,
    )
    error_options: Annotated[
        tuple[Literal["force_displacement", "displacement"], ...], all_different
    ] = option(("force_displacement", "displacement"), "Section 3.3.3", min_length=1)
    experiments: StudyExperiments = option(StudyExperiments(), "about the sensors")
    tracking: Trackers = option(Trackers(), "Section 4.3")
    solid: Solid = option(Solid(), "of the error minimisation")
    minimise: Search = option(Search(), "Section 3.3")
    simulation: Simulation = option(Simulation(), "Sections 3.3.2 to 3.3.4")

    def conflicts(self) -> Iterator[tuple]:
        """Steps with trackers that are none of the run's."""
        known = self.tracking.trackers
        for name, step in self.minimise.steps.items():
            if step.tracker not in (None, *known):
                names = ", ".join(sorted(known))
                yield f"minimise.steps.{name}.tracker", f"one of {names}", step.tracker


if __name__ == "__main__":
    with whole_file(Path(sys.argv[1])) as part:
        part.write_text(page() + OF_STUDY, encoding="utf-8")
