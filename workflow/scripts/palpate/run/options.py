"""The configuration of a run: all blocks of options."""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field, fields
from typing import Literal

from palpate.estimate.direct import options as direct
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.minimise.options import Load, Minimise
from palpate.options import NAME, Options, block, option, schema_of
from palpate.solid.options import IndentationTable, Solid
from palpate.surface.options import TRACKERS, Aligning
from palpate.vision.options import Background, Clouds, Force, ProbePose, SupportPlane

# Captures by object and sensor.
Captures = dict[str, dict[str, tuple[str, ...]]]
BOTH_TRACKERS = {name: {"kind": name} for name in TRACKERS}


def raw(default: dict, meaning: str, schema: Mapping) -> dict:
    """Field whose content stays as people write it."""
    given = {"meaning": meaning, "schema": schema}
    return field(default_factory=lambda: deepcopy(default), metadata=given)


def partly(*kinds: type[Options], **more: Mapping) -> dict:
    """Schema of some options of some kinds."""
    known = {}
    for kind in kinds:
        for name, one in schema_of(kind)["properties"].items():
            known[name] = _either(known[name], one) if name in known else one
    return {"type": "object", "additionalProperties": False, "properties": known | more}


def _either(first: dict, second: dict) -> dict:
    """Schema of what one of two schemas allows: the wider one, or both words of a kind."""
    if "enum" in first:
        return {"enum": [*first["enum"], *second["enum"]]}
    return first if "anyOf" in first or first == second else second


def by_name(schema: Mapping) -> dict:
    """Schema of blocks by a name that files may have."""
    return {"type": "object", "propertyNames": NAME, "additionalProperties": schema}


def by_object(schema: Mapping) -> dict:
    """Schema of blocks by object."""
    return {"type": "object", "additionalProperties": schema}


TRACKER = partly(*TRACKERS.values(), like={"type": "string"})


@dataclass(frozen=True, kw_only=True)
class Paths(Options):
    """Where things are."""

    raw: str = option("raw", "captures", fewest=1)
    results: str = option("results", "what is computed", fewest=1)
    sensors: str = option("config/sensors", "a file for each", fewest=1)
    probes: str = option("config/probes", "a file for each", fewest=1)
    meshes: str = option("config/meshes", "kept solid meshes, <object>.vtu", fewest=1)
    lab: str | None = option(None, "the virtual lab's file; null: dropped captures only")


@dataclass(frozen=True, kw_only=True)
class Selection(Options):
    """Of the lab's recordings, those that tables and figures use."""

    captures: Captures = option({}, "those of the run")
    tracked: Captures = option({}, "of these, those that are tracked and minimised")
    direct: Captures = option({}, "estimated directly, where they are not the tracked")
    block: str = option("", "the object of Tables 5.2 and 5.3")
    table_5_3_points: tuple[str, ...] = option((), "of Table 5.3", unique=True)
    figure_points: dict[str, str] = option({}, "of figures; else the first")


@dataclass(frozen=True, kw_only=True)
class Experiments(Options):
    """Recordings about the sensors: raw/sensors/<sensor>/<experiment>."""

    probe: str = option("", "that was filmed")
    cd_case_size_m: tuple[float, float, float] = option(
        (0.142, 0.124, 0.0104), "Section 4.2.4; a case's usual height", above=0
    )


@dataclass(frozen=True, kw_only=True)
class Tracking(Options):
    """The template through a capture (Section 4.3)."""

    estimate_from: str = option("study", "the tracker whose surfaces are minimised")
    compared: tuple[str, ...] = option((), "trackers of every tracked capture", unique=True)
    alignment: Aligning = block(Aligning, "of the template with the first frame")
    trackers: dict = raw(
        BOTH_TRACKERS,
        "by name: results tracked-<name>.npz; `like` takes over another one's options",
        by_name(TRACKER),
    )
    objects: dict = raw(
        {}, "options of single objects, by object and tracker", by_object(by_object(TRACKER))
    )


@dataclass(frozen=True, kw_only=True)
class Search(Minimise):
    """Error minimisation of a run."""

    steps: dict = raw(
        {},
        "tables/minimise_steps: options of minimise and solid, or the tracker, changed in turn",
        by_name(partly(Load, Solid, tracker={"type": "string"}) | {"minProperties": 1}),
    )
    objects: dict = raw({}, "load of single objects", by_object(partly(Load)))


@dataclass(frozen=True, kw_only=True)
class Direct(Options):
    """E and nu straight from clouds and forces."""

    model: IndentationTable = block(IndentationTable, "of a pressed point")
    observation: direct.Observation = block(direct.Observation, "of the surface")
    fit: direct.Fit = block(direct.Fit, "of E and nu")


@dataclass(frozen=True, kw_only=True)
class Config(Options):
    """All that a run's configuration may say.

    Examples
    --------
    >>> config = Config.read({"hertz": {"onset_force_n": 0.05}})
    >>> config.hertz.onset_force_n, config.clouds.voxel_m
    (0.05, 0.002)
    """

    paths: Paths = block(Paths, "of files")
    only: str | None = option(None, "name of one object, or null for all")
    seed: int = option(20150401, "of all that is drawn", least=0, most=2**53)
    methods: tuple[Literal["hertz", "direct", "minimise"], ...] = option(
        ("hertz", "direct"),
        "of people's own objects; a page needs the first two; minimise, the study's, takes minutes"
        " a capture and tells less",
        fewest=1,
        unique=True,
    )
    error_options: tuple[Literal["force_displacement", "displacement"], ...] = option(
        ("force_displacement", "displacement"), "Section 3.3.3", fewest=1, unique=True
    )
    study: Selection = block(Selection, "of the lab's recordings")
    experiments: Experiments = block(Experiments, "about the sensors")
    background: Background = block(Background, "Section 4.2.1")
    support_plane: SupportPlane = block(SupportPlane, "the table")
    probe_pose: ProbePose = block(ProbePose, "Section 4.2.2")
    force: Force = block(Force, "Section 4.1.3")
    clouds: Clouds = block(Clouds, "of the object")
    tracking: Tracking = block(Tracking, "Section 4.3")
    solid: Solid = block(Solid, "of the error minimisation")
    hertz: Hertz = block(Hertz, "Section 5.1")
    minimise: Search = block(Search, "Section 3.3")
    direct: Direct = block(Direct, "straight from clouds and forces")


def filled(config: Mapping, blocks: Mapping[str, type[Options]]) -> dict:
    """Configuration with the defaults of what people left out.

    Parameters
    ----------
    config : mapping
        As `config_schema` has it.
    blocks : mapping
        Further blocks' options, by name.
    """
    known = {one.name for one in fields(Config)}
    full = Config.read({k: v for k, v in config.items() if k in known}).written()
    own = full["tracking"]["trackers"]
    full["tracking"]["trackers"] = {
        name: BOTH_TRACKERS.get(name, {}) | own.get(name, {}) for name in {**BOTH_TRACKERS, **own}
    }
    return full | {name: kind.read(config.get(name, {})).written() for name, kind in blocks.items()}


def config_schema(blocks: Mapping[str, type[Options]]) -> dict:
    """JSON schema of a configuration with further blocks."""
    schema = schema_of(Config)
    more = {name: schema_of(kind) for name, kind in blocks.items()}
    return schema | {"properties": schema["properties"] | more}
