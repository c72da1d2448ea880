"""The configuration of a run: all blocks of options of the tool, and their page."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from inspect import getdoc
from types import NoneType
from typing import Annotated, Any, ClassVar, Literal, get_args, get_origin

from pydantic import Field, create_model, model_serializer

from palpate.config.model import (
    ABSENT,
    MOST_COUNTED,
    Model,
    all_different,
    field_at,
    members,
    option,
)
from palpate.config.probe import ProbeSpec
from palpate.config.sensor import SensorSpec
from palpate.estimate.direct import options as direct
from palpate.estimate.hertz.options import Hertz
from palpate.markdown import rows_of
from palpate.solid.options import IndentationTable, greatest_ratio
from palpate.surface.options import Aligning
from palpate.vision.options import Background, Clouds, Force, ProbePose, SupportPlane
from palpate.workflow.run import Run

FILES = {"The file of a sensor": SensorSpec, "The file of a probe": ProbeSpec}
HEAD = """# Options

What `config/config.yaml` or a file given with `--configfile` may say, and the files of sensors and
probes; [object.yaml](capture_format.md#objectyaml) is described with the capture format. What is
left out has its default. Units are in the names. `make docs` writes this page.
"""
BOUNDS = {"minimum": "at least", "exclusiveMinimum": "above"}
BOUNDS |= {"maximum": "at most", "exclusiveMaximum": "below"}
TYPES = {"boolean": "true or false", "object": "by name", "number": "a number", "string": "a text"}
TYPES |= {"integer": "an integer", "null": "null"}


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


class Paths(Model):
    """Where things are."""

    raw: str = option("raw", "captures", min_length=1)
    results: str = option("results", "what is computed", min_length=1)
    sensors: str = option("config/sensors", "a file for each", min_length=1)
    probes: str = option("config/probes", "a file for each", min_length=1)
    meshes: str = option("config/meshes", "kept solid meshes, <object>.vtu", min_length=1)
    lab: str | None = option(None, "the virtual lab's file; null: dropped captures only")


class Experiments(Model):
    """Recordings about the sensors: raw/sensors/<sensor>/<experiment>."""

    probe: str = option("", "of these recordings")


class Tracking(Model):
    """The template through a capture (Section 4.3)."""

    alignment: Aligning = option(Aligning(), "of the template with the first frame")


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
    """All that a run's configuration may say of the tool; a workflow's own is a subclass.

    Examples
    --------
    >>> config = Config.read({"hertz": {"onset_force_n": 0.05}})
    >>> config.hertz.onset_force_n, config.clouds.voxel_m
    (0.05, 0.002)
    """

    # The class of a run with this configuration.
    run: ClassVar[type[Run]] = Run
    paths: Paths = option(Paths(), "of files")
    only: str | None = option(None, "name of one object, or null for all")
    seed: int = option(20150401, "of all that is drawn", ge=0, le=2**53)
    methods: Annotated[tuple[Literal["hertz", "direct"], ...], all_different] = option(
        ("hertz", "direct"), "of people's own objects; a page needs both", min_length=1
    )
    experiments: Experiments = option(Experiments(), "about the sensors")
    background: Background = option(Background(), "Section 4.2.1")
    support_plane: SupportPlane = option(SupportPlane(), "the table")
    probe_pose: ProbePose = option(ProbePose(), "Section 4.2.2")
    force: Force = option(Force(), "Section 4.1.3")
    clouds: Clouds = option(Clouds(), "of the object")
    tracking: Tracking = option(Tracking(), "Section 4.3")
    hertz: Hertz = option(Hertz(), "Section 5.1")
    direct: Direct = option(Direct(), "straight from clouds and forces")


def as_asked(told: Any, kinds: Sequence[Any]) -> Any:
    """Give what stands after ``--config``: within braces Snakemake takes numbers for texts.

    Of what Snakemake gives, and what it may be: the configuration's model.
    """
    if isinstance(told, Mapping):
        return {key: as_asked(one, field_at(kinds, [key])[0]) for key, one in told.items()}
    if isinstance(told, list):
        return [as_asked(one, field_at(kinds, [0])[0]) for one in told]
    if not isinstance(told, str) or not kinds or (str in kinds and told != "null"):
        return told
    with suppress(ValueError):
        return float(told)
    return {"true": True, "false": False, "null": None}.get(told, told)


def page() -> str:
    """Give docs/options.md, all of it of the models: options of a run, fields of files."""
    parts = [HEAD + _table(rows(Config))]
    for name, kind in FILES.items():
        parts += [f"## {name}\n", getdoc(kind).partition("\n\nExamples")[0], _table(rows(kind))]
    return "\n".join(parts)


def rows(kind: type[Model], place: str = "") -> Iterator[tuple[str, str, str, str]]:
    """Place, default, what is allowed, and meaning of each option, in the order of the fields."""
    schema = kind.model_json_schema()["properties"]
    for name, field in kind.model_fields.items():
        kinds = list(members([field.annotation])) if not field.frozen else []
        if block := next((one for one in kinds if hasattr(one, "model_fields")), None):
            if kind is Config:
                yield name, "", "", getdoc(block)
            yield from rows(block, f"{place}{name}.")
        elif kinds and field.description:
            default = "to be given" if field.is_required() else _said(field.default)
            default = ABSENT if field.default is None and NoneType not in kinds else default
            yield f"{place}{name}", default, _allowed(schema[name]), field.description
        for one in kinds:
            if get_origin(one) is dict and hasattr(get_args(one)[1], "model_fields"):
                yield from rows(get_args(one)[1], f"{place}{name}.*.")


def _table(found: Iterable[tuple[str, ...]]) -> str:
    cells = ((f"`{place}`", *(w.replace("<", "&lt;") for w in words)) for place, *words in found)
    lines = rows_of(("option", "default", "allowed", "meaning"), cells)
    return "\n" + "\n".join(lines) + "\n"


def _said(value: Any) -> str:
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, tuple | dict):
        return ", ".join(map(_said, value)) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value) or "none"


def _allowed(rule: Mapping) -> str:
    """What a JSON schema allows, in words."""
    if words := rule.get("enum", [rule[k] for k in ("const",) if k in rule]):
        return ", ".join(map(str, words))
    if "anyOf" in rule:
        return " or ".join(map(_allowed, rule["anyOf"]))
    if rule.get("type") == "array":
        each = rule.get("prefixItems", [rule.get("items")])
        more = "" if "prefixItems" in rule else " or more,"
        many = f"{rule['minItems']}{more} " if "minItems" in rule else ""
        return f"{many}each {_allowed(each[0])}"
    said = {word: rule[key] for key, word in BOUNDS.items() if key in rule}
    limits = [f"{word} {bound:g}" for word, bound in said.items() if bound != MOST_COUNTED]
    return " and ".join(limits) or TYPES[rule["type"]]
