"""Options as frozen dataclasses: default, unit, bounds and meaning of each in one place.

A field is declared with `option`; from that follow the schema that what people write is held to
(`schema_of`), the options themselves (`read`), and their documentation (`rows`).
"""

import operator
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, asdict, dataclass, field, fields, is_dataclass
from math import isfinite
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Any, Literal, Self, TypeVar, get_args, get_origin, get_type_hints

# How JSON schema says a bound, and a sentence does.
BOUNDS = {
    "least": ("minimum", "at least"),
    "most": ("maximum", "at most"),
    "above": ("exclusiveMinimum", "above"),
    "below": ("exclusiveMaximum", "below"),
}
HOLDS = {"least": operator.ge, "most": operator.le, "above": operator.gt, "below": operator.lt}
TYPES = {
    bool: {"type": "boolean"},
    int: {"type": "integer"},
    float: {"type": "number"},
    str: {"type": "string"},
    NoneType: {"type": "null"},
}
NUMBERS = {int: Integral, float: Real}
MOST_COUNTED = 1_000_000
# Names that results' files are called by.
NAME = {
    "pattern": "^[a-z][a-z0-9_]*$",
    "description": "a name of small letters, digits and _, like elastic_02",
}

T = TypeVar("T", bound="Options")


@dataclass(frozen=True, kw_only=True)
class Options:
    """What blocks of options have in common."""

    @classmethod
    def read(cls, block: Mapping) -> Self:
        """Options of what people wrote; what they left out has its default.

        Parameters
        ----------
        block : mapping
            As `schema_of` has it.

        Raises
        ------
        ValueError
            Naming the option that there is none of, that is missing or out of its bounds.
        """
        kinds = {one.name: kind for one, kind in _kinds(cls)}
        for name in block:
            if name not in kinds:
                raise ValueError(f"{name}: expected one of {', '.join(kinds)}, found another")
        for one in fields(cls):
            if one.name not in block and not _has_default(one):
                raise ValueError(
                    f"{one.name}: expected {_allowed(kinds[one.name], one.metadata)}, found none"
                )
        return cls(**{name: _typed(kinds[name], value) for name, value in block.items()})

    def __post_init__(self) -> None:
        """Refuse what the schema would, for those who come without one."""
        for one, kind in _kinds(type(self)):
            found = getattr(self, one.name)
            if not _of_kind(kind, found):
                raise ValueError(f"{one.name}: expected {_allowed(kind, {})}, found {found!r}")
            if not _within(kind, one.metadata, found):
                allowed = _allowed(kind, one.metadata)
                raise ValueError(f"{one.name}: expected {allowed}, found {found}")

    def written(self) -> dict:
        """The options as people write them, all of them."""
        return _plain(asdict(self))


def option(default: Any, meaning: str, **bounds: Any) -> Any:
    """Field of a dataclass of options.

    Parameters
    ----------
    default
        What holds where people write nothing; ``...`` for nothing.
    meaning : str
        In words, without the unit that the name has.
    **bounds
        ``least``, ``most``, ``above``, ``below`` of the number, or of each in a list; ``fewest``
        of a list or a text, ``unique`` of a list.
    """
    known = {*BOUNDS, "fewest", "unique"}
    if unknown := sorted(bounds.keys() - known):
        raise ValueError(f"bounds: expected some of {', '.join(sorted(known))}, found {unknown[0]}")
    given = {} if default is ... else {"default": default}
    if isinstance(default, dict):
        given = {"default_factory": lambda: dict(default)}
    return field(**given, metadata={"meaning": meaning} | bounds)


def block(kind: type[T], meaning: str) -> Any:
    """Field that is a block of options of its own, with their defaults."""
    return field(default_factory=kind, metadata={"meaning": meaning})


def schema_of(kind: type[Options]) -> dict:
    """JSON schema of a block of options.

    Parameters
    ----------
    kind : type
        Dataclass whose fields were declared with `option` and `block`.
    """
    known = _kinds(kind)
    return {
        "type": "object",
        "additionalProperties": False,
        "required": [one.name for one, _ in known if not _has_default(one)],
        "properties": {one.name: _schema(of, one.metadata) for one, of in known},
    }


def rows(kind: type[Options], place: str = "") -> Iterator[tuple[str, str, str, str]]:
    """Place, default, what is allowed, and meaning of each option, in the order of the fields."""
    for one, inner in _kinds(kind):
        name = f"{place}{one.name}"
        if is_dataclass(inner):
            yield from rows(inner, f"{name}.")
        else:
            yield name, _said(one), _allowed(inner, one.metadata), one.metadata["meaning"]


def _kinds(kind: type) -> list[tuple[Field, Any]]:
    """Fields of a dataclass and what each holds."""
    hints = get_type_hints(kind)
    return [(one, hints[one.name]) for one in fields(kind)]


def _has_default(one: Any) -> bool:
    return one.default is not MISSING or one.default_factory is not MISSING


def _schema(kind: Any, bounds: Mapping) -> dict:
    """Schema of one field."""
    if "schema" in bounds:
        return bounds["schema"]
    if is_dataclass(kind):
        return schema_of(kind)
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Literal:
        return {"enum": list(parts)}
    if origin is UnionType:
        return {"anyOf": [_schema(part, bounds) for part in parts]}
    if origin is tuple:
        return _list_schema(parts, bounds)
    if origin is dict:
        names = {"propertyNames": NAME} if is_dataclass(parts[1]) else {}
        return {"type": "object", "additionalProperties": _schema(parts[1], bounds)} | names
    said = {word: bounds[name] for name, (word, _) in BOUNDS.items() if name in bounds}
    if kind is int:
        said = {"maximum": MOST_COUNTED} | said
    if kind is str and "fewest" in bounds:
        return TYPES[str] | {"minLength": bounds["fewest"]}
    return TYPES[kind] | (said if kind in (int, float) else {})


def _list_schema(parts: tuple, bounds: Mapping) -> dict:
    content = {"type": "array", "items": _schema(parts[0], bounds)}
    if parts[-1] is not ...:
        return content | {"minItems": len(parts), "maxItems": len(parts)}
    content |= {"minItems": bounds["fewest"]} if "fewest" in bounds else {}
    return content | ({"uniqueItems": True} if bounds.get("unique") else {})


def _of_kind(kind: Any, value: Any) -> bool:
    """Whether a value is of a field's kind."""
    origin, parts = get_origin(kind), get_args(kind)
    if kind is Any:
        return True
    if origin is UnionType:
        return any(_of_kind(part, value) for part in parts)
    if origin is Literal:
        return type(value) in set(map(type, parts))
    if origin is tuple:
        several = isinstance(value, list | tuple)
        several = several and (parts[-1] is ... or len(value) == len(parts))
        return several and all(_of_kind(parts[0], one) for one in value)
    if origin is dict:
        return isinstance(value, dict) and all(_of_kind(parts[1], one) for one in value.values())
    if isinstance(value, bool):
        return kind is bool
    return isinstance(value, NUMBERS.get(kind, kind))


def _within(kind: Any, bounds: Mapping, value: Any) -> bool:
    """Whether a value of a field's kind is among its words, and within its bounds."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is UnionType:
        return any(_of_kind(part, value) and _within(part, bounds, value) for part in parts)
    if origin is Literal:
        return value in parts
    if origin is tuple:
        several = len(value) >= bounds.get("fewest", 0)
        several = several and (not bounds.get("unique") or len(set(value)) == len(value))
        each = {name: bounds[name] for name in BOUNDS if name in bounds}
        return several and all(_within(parts[0], each, one) for one in value)
    if kind is str:
        return len(value) >= bounds.get("fewest", 0)
    if kind not in NUMBERS:
        return True
    limits = ({"most": MOST_COUNTED} if kind is int else {}) | bounds
    held = (holds(value, limits[name]) for name, holds in HOLDS.items() if name in limits)
    return isfinite(value) and all(held)


def _typed(kind: Any, value: Any) -> Any:
    """Value of a field: blocks as their dataclass, lists as tuples."""
    if is_dataclass(kind) and isinstance(value, Mapping):
        return kind.read(value)
    if get_origin(kind) is tuple and isinstance(value, list | tuple):
        return tuple(_typed(get_args(kind)[0], one) for one in value)
    if get_origin(kind) is dict and isinstance(value, Mapping):
        return {key: _typed(get_args(kind)[1], one) for key, one in value.items()}
    if get_origin(kind) is UnionType and value is not None:
        return _typed(next(part for part in get_args(kind) if part is not NoneType), value)
    return value


def _plain(value: Any) -> Any:
    """Value as YAML and JSON have it."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, tuple) else value


def _said(one: Any) -> str:
    """A field's default, in words."""
    if not _has_default(one):
        return "to be given"
    default = one.default if one.default is not MISSING else one.default_factory()
    if isinstance(default, tuple):
        return ", ".join(map(_word, default)) or "none"
    return _word(default)


def _word(value: Any) -> str:
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, dict) or value == "":
        return "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _allowed(kind: Any, bounds: Mapping) -> str:
    """What a field may be, in words."""
    if "schema" in bounds:
        return "blocks by name"
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Literal:
        return ", ".join(map(str, parts))
    if origin is tuple:
        inner = _allowed(parts[0], bounds)
        many = f"{bounds['fewest']} or more, " if "fewest" in bounds else ""
        many = many if parts[-1] is ... else f"{len(parts)} "
        return f"{many}each {inner}{', no two alike' if bounds.get('unique') else ''}"
    if origin is UnionType:
        return " or ".join(filter(None, (_allowed(part, bounds) for part in parts)))
    if origin is dict:
        return "by name"
    if kind is bool:
        return "true or false"
    if kind is NoneType:
        return "null"
    limits = [f"{word} {bounds[name]:g}" for name, (_, word) in BOUNDS.items() if name in bounds]
    if limits:
        return " and ".join(limits)
    if isinstance(kind, type) and issubclass(kind, Options):
        return "a block of options"
    return {int: "an integer", float: "a number", str: "a text"}.get(kind, "")
