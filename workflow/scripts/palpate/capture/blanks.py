"""Files to be filled in: all that is asked for, what to put there, and what is known of it."""

import textwrap
from collections.abc import Iterator, Mapping
from copy import deepcopy
from functools import reduce
from inspect import getdoc
from operator import getitem
from typing import Any, get_args, get_origin

import yaml

from palpate.config.model import ABSENT, FILL_IN, Model, field_at, members, missing_fields
from palpate.config.object import ObjectSpec
from palpate.config.probe import ProbeSpec
from palpate.config.sensor import SensorSpec

WIDTH = 100
INDENT = "  "
MODELS = {"object": ObjectSpec, "sensor": SensorSpec, "probe": ProbeSpec}
# What may be left out and is worth a thought, shown behind a #.
OFFERED = {
    "object": (("support", "contact"), ("deepest_m",)),
    "sensor": (("clock_offset_std_s",),),
    "probe": (("stiffness_n_m",), ("load",), ("gauge",)),
}


def blank(kind: str, known: Mapping) -> dict:
    """Give a specification with all fields that are asked for.

    Parameters
    ----------
    kind : {"object", "sensor", "probe"}
        Whose.
    known : mapping
        What is known already.

    Returns
    -------
    dict
        With the model's example where it has one, else with `palpate.config.model.FILL_IN`.
    """
    spec = deepcopy(dict(known))
    while missing := missing_fields(MODELS[kind], spec):
        for field in missing:
            reduce(getitem, field[:-1], spec)[field[-1]] = _value(kind, field)
    return spec


def blank_text(kind: str, known: Mapping) -> str:
    """Give a blank specification as YAML in the model's order, with a comment for each field.

    See `blank` for the parameters.
    """
    head = f"Put your values in place of each {FILL_IN}; `palpate check` says what is left."
    head += " Fields behind a # may be left out."
    return "\n".join([*_comment(head), "", *_lines(kind, (), blank(kind, known), set()), ""])


def _value(kind: str, place: tuple[str, ...]) -> Any:
    """What stands for a field that nobody has filled in."""
    kinds, field = field_at([MODELS[kind]], place)
    if field.examples:
        return deepcopy(field.examples[0])
    if isinstance(field.default, str | float) and field.default is not ABSENT:
        return field.default
    for one in kinds:
        if isinstance(one, type) and issubclass(one, Model):
            needed = [name for name, field in one.model_fields.items() if field.is_required()]
            return {name: _value(kind, (*place, name)) for name in needed}
    return _blank(kinds[0])


def _blank(kind: Any) -> Any:
    """As many marks as a value of a type has parts."""
    (kind,) = members([kind])
    return list(map(_blank, get_args(kind))) if get_origin(kind) is tuple else FILL_IN


def _lines(kind: str, place: tuple[str, ...], spec: Mapping, said: set[str]) -> Iterator[str]:
    """Lines of a mapping: its fields in the model's order, then those that people name."""
    kinds = field_at([MODELS[kind]], place)[0]
    known = [name for one in kinds for name in getattr(one, "model_fields", ())]
    for key in dict.fromkeys([*known, *spec]):
        field = (*place, key)
        if key in spec:
            yield from _field(kind, field, spec[key], said)
        elif field in OFFERED[kind]:
            yield from (f"# {line}" for line in _field(kind, field, _value(kind, field), said))


def _field(kind: str, place: tuple[str, ...], value: Any, said: set[str]) -> Iterator[str]:
    """Lines of a field; what was said of another one is not said again."""
    (kinds, field), key = field_at([MODELS[kind]], place), place[-1]
    block = next((getdoc(one) for one in kinds if hasattr(one, "model_fields")), "")
    text = (field and (field.description or block)) or ""
    yield from [] if text in said else _comment(text)
    said.add(text)
    if isinstance(value, Mapping):
        yield f"{key}:" if key.isidentifier() else f'"{key}":'
        yield from (INDENT + line for line in _lines(kind, place, value, said))
    else:
        flow = None if isinstance(value, list) else False
        yield from yaml.safe_dump({key: value}, default_flow_style=flow, width=WIDTH).splitlines()


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH - 10, initial_indent="# ", subsequent_indent="# ")
