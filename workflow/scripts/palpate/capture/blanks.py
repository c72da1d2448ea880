"""Files to be filled in: all that a schema asks for, what to put there, and what is known of it."""

import textwrap
from collections.abc import Mapping
from typing import Any

import yaml

from palpate.capture.schema import FILL_IN, SCHEMAS, load_yaml, missing_fields, part_of

WIDTH = 100
INDENT = "  "
# What may be left out and is worth a thought, shown behind a #.
OFFERED = {
    "object": (("support", "contact"), ("deepest_m",)),
    "sensor": (("clock_offset_std_s",),),
    "probe": (("stiffness_n_m",), ("load",), ("gauge",)),
}


def blank(kind: str, known: Mapping) -> dict:
    """Give a specification with all fields that its schema asks for.

    Parameters
    ----------
    kind : {"object", "sensor", "probe"}
        Whose schema.
    known : mapping
        What is known already.

    Returns
    -------
    dict
        With the schema's default where it has one, else with `palpate.capture.schema.FILL_IN`.
    """
    path = SCHEMAS / f"{kind}.schema.yaml"
    schema, spec = load_yaml(path), _copy(known)
    while missing := missing_fields(spec, path):
        for field in missing:
            place, rule = spec, schema
            for key in field[:-1]:
                place, rule = place[key], part_of(schema, rule, key)
            place[field[-1]] = _value(schema, part_of(schema, rule, field[-1]))
    return spec


def blank_text(kind: str, known: Mapping) -> str:
    """Give a blank specification as YAML in the schema's order, with a comment for each field.

    See `blank` for the parameters.
    """
    schema = load_yaml(SCHEMAS / f"{kind}.schema.yaml")
    lines = _lines(schema, schema, blank(kind, known), OFFERED[kind], set())
    head = f"Put your values in place of each {FILL_IN}; `palpate check` says what is left."
    head += " Fields behind a # may be left out."
    return "\n".join([*_comment(head), "", *lines, ""])


def _copy(known: Mapping) -> dict:
    return {k: _copy(v) if isinstance(v, Mapping) else v for k, v in known.items()}


def _value(schema: Mapping, rule: Mapping) -> Any:
    """What stands for a field that nobody has filled in."""
    if "default" in rule:
        return rule["default"]
    if "properties" in rule:
        return {key: _value(schema, part_of(schema, rule, key)) for key in rule.get("required", ())}
    if rule.get("type") == "array":
        return [_value(schema, rule["items"]) for _ in range(rule["minItems"])]
    return FILL_IN


def _lines(
    schema: Mapping, rule: Mapping, spec: Mapping, offered: tuple, said: set[str]
) -> list[str]:
    """Lines of a mapping: its fields in the schema's order, then those that people name."""
    lines = []
    for key in dict.fromkeys([*rule.get("properties", {}), *spec]):
        part = part_of(schema, rule, key)
        inner = tuple(field[1:] for field in offered if field[0] == key and len(field) > 1)
        if key in spec:
            lines += _field(schema, part, key, spec[key], inner, said)
        elif (key,) in offered:
            value = _value(schema, part)
            lines += [f"# {line}" for line in _field(schema, part, key, value, inner, said)]
    return lines


def _field(
    schema: Mapping, rule: Mapping, key: str, value: Any, offered: tuple, said: set[str]
) -> list[str]:
    """Lines of a field; what was said of another one is not said again."""
    text = rule.get("description", "")
    lines = [] if text in said else _comment(text)
    said.add(text)
    if not isinstance(value, Mapping):
        flow = None if isinstance(value, list) else False
        plain = yaml.safe_dump({key: value}, default_flow_style=flow, width=WIDTH)
        return lines + plain.splitlines()
    name = key if key.isidentifier() else f'"{key}"'
    inner = _lines(schema, rule, value, offered, said)
    return [*lines, f"{name}:", *(INDENT + line for line in inner)]


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH - 10, initial_indent="# ", subsequent_indent="# ")
