"""Documentation of options, of the models themselves."""

import json
from collections.abc import Iterable, Iterator, Mapping
from inspect import getdoc
from types import NoneType
from typing import Any, get_args, get_origin

from palpate.config.model import ABSENT, MOST_COUNTED, Model, members
from palpate.markdown import rows_of

HEAD = """# Options

What `config/config.yaml`, `config/thesis.yaml`, or a file given with `--configfile` may say, and at
the end the files of objects, sensors and probes. What is left out has its default. Units are in the
names. This page is written by `make docs`.
"""
BOUNDS = {"minimum": "at least", "exclusiveMinimum": "above"}
BOUNDS |= {"maximum": "at most", "exclusiveMaximum": "below"}
TYPES = {"boolean": "true or false", "object": "by name", "number": "a number", "string": "a text"}
TYPES |= {"integer": "an integer", "null": "null"}


def options_page(config: type[Model], further: Mapping[str, type[Model]]) -> str:
    """Give all options as Markdown: a table for each block, and for each of further models."""
    fields = config.model_fields.items()
    blocks = {name: f.annotation for name, f in fields if hasattr(f.annotation, "model_fields")}
    plain = [row for row in rows(config) if row[0].partition(".")[0] not in blocks]
    parts = [HEAD, "## The run", _table(plain)]
    for name, kind in {**blocks, **further}.items():
        words = getdoc(kind).partition("\n\nExamples")[0]
        place = f"{name}." if name in blocks else ""
        parts += [f"## {name}", "", words, _table(rows(kind, place))]
    return "\n".join(parts)


def rows(kind: type[Model], place: str = "") -> Iterator[tuple[str, str, str, str]]:
    """Place, default, what is allowed, and meaning of each option, in the order of the fields."""
    schema = kind.model_json_schema()["properties"]
    for name, field in kind.model_fields.items():
        kinds = list(members([field.annotation])) if not field.frozen else []
        if block := next((one for one in kinds if hasattr(one, "model_fields")), None):
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
