"""The configuration of a run: all blocks of options; ``-m palpate.workflow.options PAGE``."""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    create_model,
    model_serializer,
    model_validator,
)

from palpate.capture.files import whole_file
from palpate.config.model import (
    FileName,
    Model,
    Positive,
    all_different,
    field_at,
    option,
    problems,
)
from palpate.config.object import ObjectSpec
from palpate.config.page import options_page
from palpate.config.probe import ProbeSpec
from palpate.config.sensor import SensorSpec
from palpate.estimate.direct import options as direct
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.minimise.options import Load, Minimise, Solid
from palpate.solid.options import IndentationTable, greatest_ratio
from palpate.surface.options import TRACKERS, Aligning
from palpate.surface.trackers import tracker_problems
from palpate.vision.options import Background, Clouds, Force, ProbePose, SupportPlane

# Captures by object and sensor.
Captures = dict[str, dict[str, tuple[str, ...]]]
BOTH_TRACKERS = {name: {"kind": name} for name in TRACKERS}


class Partial(Model):
    """Some options of other blocks; what is left out is not among them."""

    @model_serializer(mode="wrap")
    def _said(self, handler: Callable) -> dict:
        return {k: v for k, v in handler(self).items() if k in self.model_fields_set}


def partly(*kinds: type[Model], **more: Any) -> type[Partial]:
    """Model of some options of some kinds; of two of a name the first one's, or ``more``'s."""
    known = {}
    for kind in kinds:
        for name, field in kind.model_fields.items():
            of = Annotated[field.annotation, Field(frozen=field.frozen), *field.metadata]
            known.setdefault(name, (of, field.default if field.frozen else None))
    names = " and ".join(kind.__name__ for kind in kinds)
    further = {name: (kind, None) for name, kind in more.items()}
    return create_model(f"Some of {names}", __base__=Partial, **(known | further))


Tracker = partly(*TRACKERS.values(), like=str, kind=Literal[tuple(TRACKERS)])
Step = partly(Load, Solid, tracker=str)


class Paths(Model):
    """Where things are."""

    raw: str = option("raw", "captures", min_length=1)
    results: str = option("results", "what is computed", min_length=1)
    sensors: str = option("config/sensors", "a file for each", min_length=1)
    probes: str = option("config/probes", "a file for each", min_length=1)
    meshes: str = option("config/meshes", "kept solid meshes, <object>.vtu", min_length=1)
    lab: str | None = option(None, "the virtual lab's file; null: dropped captures only")


class Selection(Model):
    """Of the lab's recordings, those that tables and figures use."""

    captures: Captures = option({}, "those of the run")
    tracked: Captures = option({}, "of these, those that are tracked and minimised")
    direct: Captures = option({}, "estimated directly, where they are not the tracked")
    block: str = option("", "the object of Tables 5.2 and 5.3")
    table_5_3_points: Annotated[tuple[str, ...], all_different] = option((), "of Table 5.3")
    figure_points: dict[str, str] = option({}, "of figures; else the first")


class Experiments(Model):
    """Recordings about the sensors: raw/sensors/<sensor>/<experiment>."""

    probe: str = option("", "that was filmed")
    cd_case_size_m: tuple[Positive, Positive, Positive] = option(
        (0.142, 0.124, 0.0104), "Section 4.2.4; a case's usual height"
    )


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


class Tracking(Model):
    """The template through a capture (Section 4.3)."""

    estimate_from: str = option("study", "the tracker whose surfaces are minimised")
    compared: Annotated[tuple[str, ...], all_different] = option(
        (), "trackers of every tracked capture"
    )
    alignment: Aligning = option(Aligning(), "of the template with the first frame")
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


class Direct(Model):
    """E and nu straight from clouds and forces."""

    model: IndentationTable = option(IndentationTable(), "of a pressed point")
    observation: direct.Observation = option(direct.Observation(), "of the surface")
    fit: direct.Fit = option(direct.Fit(), "of E and nu")

    def conflicts(self) -> Iterator[tuple]:
        """Poisson's ratios beyond the table's."""
        ratios, (low, high) = self.model.poisson_ratios, self.fit.poisson_ratio_bounds
        greatest = greatest_ratio(ratios)
        if not ratios[0] <= low < high <= greatest:
            expected = f"low and high within the table's {ratios[0]:g} to {greatest:g}"
            yield "fit.poisson_ratio_bounds", expected, f"{low:g}, {high:g}"


class Config(Model):
    """All that a run's configuration may say.

    Examples
    --------
    >>> config = Config.read({"hertz": {"onset_force_n": 0.05}})
    >>> config.hertz.onset_force_n, config.clouds.voxel_m
    (0.05, 0.002)
    """

    paths: Paths = option(Paths(), "of files")
    only: str | None = option(None, "name of one object, or null for all")
    seed: int = option(20150401, "of all that is drawn", ge=0, le=2**53)
    methods: Annotated[tuple[Literal["hertz", "direct", "minimise"], ...], all_different] = option(
        ("hertz", "direct"),
        "of people's own objects; a page needs the first two; minimise, the study's, takes minutes"
        " a capture and tells less",
        min_length=1,
    )
    error_options: Annotated[
        tuple[Literal["force_displacement", "displacement"], ...], all_different
    ] = option(("force_displacement", "displacement"), "Section 3.3.3", min_length=1)
    study: Selection = option(Selection(), "of the lab's recordings")
    experiments: Experiments = option(Experiments(), "about the sensors")
    background: Background = option(Background(), "Section 4.2.1")
    support_plane: SupportPlane = option(SupportPlane(), "the table")
    probe_pose: ProbePose = option(ProbePose(), "Section 4.2.2")
    force: Force = option(Force(), "Section 4.1.3")
    clouds: Clouds = option(Clouds(), "of the object")
    tracking: Tracking = option(Tracking(), "Section 4.3")
    solid: Solid = option(Solid(), "of the error minimisation")
    hertz: Hertz = option(Hertz(), "Section 5.1")
    minimise: Search = option(Search(), "Section 3.3")
    direct: Direct = option(Direct(), "straight from clouds and forces")

    def conflicts(self) -> Iterator[tuple]:
        """Steps with trackers that are none of the run's."""
        known = self.tracking.trackers
        for name, step in self.minimise.steps.items():
            if step.tracker not in (None, *known):
                names = ", ".join(sorted(known))
                yield f"minimise.steps.{name}.tracker", f"one of {names}", step.tracker


def filled(config: Mapping, blocks: Mapping[str, type[Model]]) -> dict:
    """Configuration, and further blocks, with the defaults of what people left out."""
    full = Config.read({k: v for k, v in config.items() if k in Config.model_fields}).written()
    return full | {name: kind.read(config.get(name, {})).written() for name, kind in blocks.items()}


def config_problems(config: Mapping, blocks: Mapping[str, type[Model]], source: str) -> list[str]:
    """Say in a line each what is wrong with a configuration with further blocks."""
    return problems(_with(blocks), config, source)


def as_asked(told: Any, blocks: Mapping[str, type[Model]]) -> Any:
    """Give what stands after ``--config``: within braces Snakemake takes numbers for texts."""
    return _as_asked(told, [_with(blocks)])


def _as_asked(told: Any, kinds: Sequence[Any]) -> Any:
    if isinstance(told, Mapping):
        return {key: _as_asked(one, field_at(kinds, [key])[0]) for key, one in told.items()}
    if isinstance(told, list):
        return [_as_asked(one, field_at(kinds, [0])[0]) for one in told]
    if not isinstance(told, str) or not kinds or (str in kinds and told != "null"):
        return told
    with suppress(ValueError):
        return float(told)
    return {"true": True, "false": False, "null": None}.get(told, told)


def _with(blocks: Mapping[str, type[Model]]) -> type[Config]:
    further = {name: (kind, kind()) for name, kind in blocks.items()}
    return create_model("Config", __base__=Config, **further)


FILES = {
    "object.yaml of an object": ObjectSpec,
    "The file of a sensor": SensorSpec,
    "The file of a probe": ProbeSpec,
}


def page() -> str:
    """Give docs/options.md."""
    further = {f"Trackers of kind {name}": kind for name, kind in TRACKERS.items()}
    return options_page(Config, further | FILES)


if __name__ == "__main__":
    with whole_file(Path(sys.argv[1])) as part:
        part.write_text(page(), encoding="utf-8")
