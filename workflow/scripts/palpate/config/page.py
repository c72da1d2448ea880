"""Documentation of options, of the models themselves."""

from collections.abc import Iterator, Mapping
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
BOUNDS = {
    "minimum": "at least",
    "exclusiveMinimum": "above",
    "maximum": "at most",
    "exclusiveMaximum": "below",
}
TYPES = {"boolean": "true or false", "object": "by name", "number": "a number", "string": "a text"}


def options_page(config: type[Model], further: Mapping[str, type[Model]]) -> str:
    """Give all options as Markdown: a table for each block, and for each of further models."""
    blocks = {n: f.annotation for n, f in config.model_fields.items() if _is_block(f.annotation)}
    plain = [row for row in rows(config) if row[0].partition(".")[0] not in blocks]
    parts = [HEAD, "## The run", _table(plain)]
    for name, kind in blocks.items():
        parts += [f"## {name}", "", _words(kind), _table(rows(kind, f"{name}."))]
    for name, kind in further.items():
        parts += [f"## {name}", "", _words(kind), _table(rows(kind))]
    return "\n".join(parts)


def rows(kind: type[Model], place: str = "") -> Iterator[tuple[str, str, str, str]]:
    """Place, default, what is allowed, and meaning of each option, in the order of the fields."""
    schema = kind.model_json_schema()["properties"]
    for name, field in kind.model_fields.items():
        if field.frozen:
            continue
        kinds = list(members([field.annotation]))
        if block := next(filter(_is_block, kinds), None):
            yield from rows(block, f"{place}{name}.")
            continue
        default = "to be given" if field.is_required() else _said(field.default)
        if field.default is None and NoneType not in kinds:
            default = ABSENT
        if field.description:
            yield f"{place}{name}", default, _allowed(schema[name]), field.description
        for one in kinds:
            if get_origin(one) is dict and _is_block(get_args(one)[1]):
                yield from rows(get_args(one)[1], f"{place}{name}.*.")


def _is_block(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Model)


def _words(kind: type[Model]) -> str:
    """What a block is, without its example."""
    return getdoc(kind).partition("\n\nExamples")[0]


def _table(found: Any) -> str:
    cells = (
        (f"`{place}`", *(one.replace("<", "&lt;") for one in words)) for place, *words in found
    )
    lines = rows_of(("option", "default", "allowed", "meaning"), cells)
    return "\n" + "\n".join(lines) + "\n"


def _said(value: Any) -> str:
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, tuple):
        return ", ".join(map(_said, value)) or "none"
    if isinstance(value, dict) or value == "":
        return ", ".join(value) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


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
    kind = rule.get("type")
    return " and ".join(limits) or TYPES.get(kind, "null" if kind == "null" else f"an {kind}")
