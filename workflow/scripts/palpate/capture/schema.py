"""Read YAML that people write, and hold it to a JSON schema."""

import math
import re
from collections.abc import Hashable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import jsonschema.protocols
import jsonschema.validators
import yaml

from palpate.capture.words import one_line

SCHEMAS = Path(__file__).resolve().parents[1] / "schemas"
# Stands for what must be filled in; no schema lets it through.
FILL_IN = "FILL_IN"
TYPE_NAMES = {
    "null": "null",
    "object": "a mapping",
    "array": "a list",
    "string": "a text",
    "integer": "an integer",
}
LIMITS = {
    "minimum": ">=",
    "maximum": "<=",
    "exclusiveMinimum": ">",
    "exclusiveMaximum": "<",
}
LONGEST_VALUE = 60
# What people write by hand stays far below; aliases can make a short file hold billions of values.
LARGEST_BYTES, MOST_VALUES = 1_000_000, 100_000
MERGE = "tag:yaml.org,2002:merge"
# What PyYAML's constructors raise over tagged values that are none: !!float abc, 2020-13-45.
NO_VALUES = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError)


class _UniqueKeys(yaml.SafeLoader):
    """Safe loader that refuses a key given twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        seen = set()
        for name, _ in node.value:
            if name.tag == MERGE:
                continue
            key = self.construct_object(name, deep=deep)
            if isinstance(key, Hashable) and key in seen:
                raise yaml.YAMLError(f"key {key} is given twice")
            seen |= {key} if isinstance(key, Hashable) else set()
        return super().construct_mapping(node, deep)


def load_yaml(path: str | Path) -> Any:
    """Read a YAML file of plain values.

    Raises
    ------
    ValueError
        If the file is missing, is no YAML, gives a key twice, or holds more than people write.
    """
    path = Path(path)
    if not is_file(path):
        raise ValueError(one_line(f"{path}: file: expected YAML, found nothing"))
    if path.stat().st_size > LARGEST_BYTES:
        found = f"expected YAML of at most {LARGEST_BYTES} bytes, found {path.stat().st_size}"
        raise ValueError(one_line(f"{path}: file: {found}"))
    try:
        return _plain(path.read_text(encoding="utf-8-sig"))
    except (yaml.YAMLError, *NO_VALUES) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        line = f"{path}: file: expected plain YAML, found none ({reason})"
        raise ValueError(one_line(line)) from None


def is_file(path: Path) -> bool:
    """Whether a file stands there; False for names that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _plain(text: str) -> Any:
    loader = _UniqueKeys(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return None
        if _values(node, {}) > MOST_VALUES:
            raise yaml.YAMLError(f"more than {MOST_VALUES} values, or one that holds itself")
        return loader.construct_document(node)
    finally:
        loader.dispose()


def _values(node: yaml.Node, known: dict[int, int]) -> int:
    """Values below a node, those behind aliases as often as they are named."""
    if id(node) not in known:
        known[id(node)] = MOST_VALUES  # of a node that holds itself
        parts = node.value if isinstance(node, yaml.CollectionNode) else ()
        flat = (one for part in parts for one in (part if isinstance(part, tuple) else (part,)))
        known[id(node)] = 1 + sum(_values(one, known) for one in flat)
    return known[id(node)]


def validate(value: Any, schema: str | Path | Mapping, source: str) -> list[str]:
    """Hold a value to a JSON schema written as YAML.

    Parameters
    ----------
    value
        What was read.
    schema : path or mapping
        The schema, or its file.
    source : str
        Name of the file that people wrote, for the messages.

    Returns
    -------
    list of str
        One line for each problem: file, field, expected, found.
    """
    held, blank = _held_to(schema), blank_fields(value)
    lines = [
        line
        for error in held.iter_errors(value)
        if _says_more(error) and not any(_begins(error.absolute_path, field) for field in blank)
        for line in _lines(error, source)
    ]
    lines += _beyond_json(value, source, "")
    # What is left to fill in comes last, and in the file's order.
    left = [_to_fill_in(held.schema, field, source) for field in blank]
    return [*sorted(dict.fromkeys(lines)), *left]


def blank_fields(value: Any) -> list[tuple[str, ...]]:
    """List the fields of a file where something is left to fill in; a list is one field."""
    return list(dict.fromkeys(_blank_fields(value, ())))


def _blank_fields(value: Any, field: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    if isinstance(value, str) and value == FILL_IN:
        yield field
    elif isinstance(value, Mapping):
        for key, content in value.items():
            yield from _blank_fields(content, (*field, str(key)))
    elif isinstance(value, list):
        for content in value:
            yield from _blank_fields(content, field)


def _begins(path: Sequence, field: tuple[str, ...]) -> bool:
    return tuple(map(str, path))[: len(field)] == field


def _to_fill_in(schema: Mapping, field: tuple[str, ...], source: str) -> str:
    rule = schema
    for key in field:
        rule = part_of(schema, rule, key)
    expected = rule.get("description", "a value")
    return _line(source, ".".join(field), "", expected, "nothing filled in yet")


def part_of(schema: Mapping, rule: Mapping, key: str) -> Mapping:
    """Give what a schema says of a field in a mapping, references followed; else nothing."""
    others = rule.get("additionalProperties")
    part = rule.get("properties", {}).get(key, others if isinstance(others, Mapping) else {})
    if "$ref" not in part:
        return part
    return schema["$defs"][part["$ref"].rpartition("/")[2]] | part


def missing_fields(value: Any, schema: str | Path) -> list[tuple[str, ...]]:
    """List the fields that a schema asks for and a value lacks."""
    return [
        (*map(str, error.absolute_path), key)
        for error in _held_to(schema).iter_errors(value)
        if error.validator == "required"
        for key in error.validator_value
        if key not in error.instance
    ]


def _held_to(schema: str | Path | Mapping) -> jsonschema.protocols.Validator:
    return _validator(schema) if isinstance(schema, Mapping) else _read_validator(Path(schema))


@cache
def _read_validator(schema: Path) -> jsonschema.protocols.Validator:
    return _validator(load_yaml(schema))


def _validator(schema: Mapping) -> jsonschema.protocols.Validator:
    kind = jsonschema.validators.extend(jsonschema.Draft202012Validator, {"pattern": _pattern})
    return kind(schema)


def _pattern(
    validator: jsonschema.protocols.Validator, pattern: str, instance: Any, schema: Mapping
) -> Iterator[jsonschema.ValidationError]:
    """Hold the whole of a text to a pattern: Python's $ passes over a newline at the end."""
    if isinstance(instance, str) and not re.fullmatch(pattern, instance):
        yield jsonschema.ValidationError(f"{instance!r} is not like {pattern!r}")


def _beyond_json(value: Any, source: str, field: str) -> Iterator[str]:
    """Lines for what YAML can say and a JSON schema can't hold: other keys than texts, no number.

    YAML reads the key 01 as the number 1, which is no point's name.
    """
    if isinstance(value, Mapping):
        for key, content in value.items():
            if not isinstance(key, str):
                yield _line(source, field, str(key), "a key in quotes", f"the bare {key}")
            yield from _beyond_json(content, source, f"{field}.{key}".lstrip("."))
    elif isinstance(value, list):
        for index, content in enumerate(value):
            yield from _beyond_json(content, source, f"{field}.{index}".lstrip("."))
    elif isinstance(value, float) and not math.isfinite(value):
        yield _line(source, field, "", "a finite number", str(value))


def _says_more(error: jsonschema.ValidationError) -> bool:
    """Whether an error says more than that a number is none, which has its own line."""
    endless = isinstance(error.instance, float) and not math.isfinite(error.instance)
    return not (endless and error.validator in LIMITS)


def _lines(error: jsonschema.ValidationError, source: str) -> list[str]:
    field = ".".join(str(part) for part in error.absolute_path)
    if error.validator == "additionalProperties":
        known = set(error.schema.get("properties", {}))
        unknown = [str(key) for key in error.instance if key not in known]
        return [_line(source, field, key, f"one of {_listed(known)}", key) for key in unknown]
    if error.validator in ("required", "dependentRequired"):
        missing = [key for key in error.validator_value if key not in error.instance]
        return [_line(source, field, key, "a value", "nothing") for key in missing]
    return [_line(source, field, "", _expected(error), _short(error.instance))]


def _line(source: str, field: str, key: str, expected: str, found: str) -> str:
    name = ".".join(part for part in (field, key) if part) or "content"
    return one_line(f"{source}: {name}: expected {expected}, found {found}")


def _expected(error: jsonschema.ValidationError) -> str:
    rule, value = error.validator, error.validator_value
    if rule == "not" and value == {}:
        return "no such field beside the others"
    if rule == "type":
        names = [value] if isinstance(value, str) else value
        return " or ".join(TYPE_NAMES.get(name, f"a {name}") for name in names)
    if rule in LIMITS:
        return f"a number {LIMITS[rule]} {value}"
    if rule == "enum":
        return f"one of {_listed(value)}"
    if rule in ("minItems", "maxItems"):
        return f"{'at least' if rule == 'minItems' else 'at most'} {value} entries"
    if rule == "const":
        return str(value)
    if rule == "pattern":
        # Each pattern of the schemas says beside it, in words, what it lets through.
        return error.schema.get("description", f"a text like {value}")
    return f"what the schema's {rule} asks for ({_short(value)})"


def _listed(values: Any) -> str:
    return ", ".join(sorted(str(value) for value in values))


def _short(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"a mapping of {_listed(value) or 'nothing'}"
    text = " ".join(repr(value).split())
    return text if len(text) <= LONGEST_VALUE else text[:LONGEST_VALUE] + "..."
