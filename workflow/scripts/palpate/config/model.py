"""Base of all options and specifications, and the messages about what people write."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import NoneType, UnionType
from typing import Annotated, Any, Self, Union, get_args, get_origin

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    WrapValidator,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import PydanticKnownError

from palpate.yaml_files import one_line

# Stands for what must be filled in; no model lets it through.
FILL_IN = "FILL_IN"
# Default of a field that `with_others` may ask for.
ABSENT = "left out"
LONGEST_VALUE = 60

MOST_COUNTED = 1_000_000
Count = Annotated[int, Field(le=MOST_COUNTED)]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
# Metres, of lengths on an object: millimetres taken for metres are far beyond.
Length = Annotated[float, Field(gt=0, le=0.2)]
Vector = tuple[float, float, float]
# Patterns of names, and what they allow, in words.
FILE_NAME = "^[a-z][a-z0-9_]*$"
PATTERNS = {FILE_NAME: "a name of small letters, digits and _, like elastic_02"}
# Names that results' files are called by.
FileName = Annotated[str, Field(pattern=FILE_NAME)]

# Poisson's ratios that linear elasticity has.
Ratio = Annotated[float, Field(ge=0, lt=0.5)]

TYPES = {
    "float_type": "a number",
    "int_type": "an integer",
    "bool_type": "a boolean",
    "string_type": "a text",
    "tuple_type": "a list",
    "model_type": "a mapping",
    "dict_type": "a mapping",
    "finite_number": "a finite number",
    "literal_error": "",
}
LIMITS = {
    "greater_than_equal": (">=", "ge"),
    "less_than_equal": ("<=", "le"),
    "greater_than": (">", "gt"),
    "less_than": ("<", "lt"),
}


class Model(BaseModel):
    """Frozen values that people may write; a list is a tuple, and nothing is converted besides."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    @model_validator(mode="wrap")
    @classmethod
    def _as_written(cls, value: Any, handler: Callable) -> Self:
        """Lists become tuples; a whole number that is written without a point stays so."""
        value = _tuples(value)
        made = handler(value)
        for name, one in value.items() if isinstance(value, Mapping) else ():
            now = made.__dict__.get(name)
            if isinstance(now, float | tuple) and now == one:
                made.__dict__[name] = one
        return made

    @classmethod
    def read(cls, value: Any, source: str = "") -> Self:
        """Give the values that people wrote; what they left out has its default.

        Parameters
        ----------
        value : mapping
            As YAML gives it.
        source : str, optional
            Name of the file, for the messages.

        Raises
        ------
        ValueError
            With one line for each problem: file, field, expected, found.
        """
        if lines := problems(cls, value, source):
            raise ValueError("\n".join(lines))
        return cls.model_validate(value)

    def changed(self, **changes: Any) -> Self:
        """Give the same with some values changed.

        Raises
        ------
        ValueError
            As `read`.
        """
        return self.read(dict(self) | changes)

    def written(self) -> dict:
        """Give all values as people write them."""
        return _lists(self.model_dump())


def option(default: Any, meaning: str, **bounds: Any) -> Any:
    """Field of a model: its default (``...``: to be given), its meaning, and pydantic's bounds.

    None where the type has none: may be left out. ``examples``: what a file to fill in has there.
    """
    return Field(default, description=meaning, validate_default=default is ABSENT, **bounds)


def with_others(field: str, *values: str, needed: bool = True, only: bool = True) -> WrapValidator:
    """Of a field that is there if an earlier one has one of some values: needed, and only then."""

    def checked(value: Any, handler: Callable, info: ValidationInfo) -> Any:
        fits = field in info.data and info.data[field] in values
        if value is ABSENT:
            if fits and needed:
                raise PydanticKnownError("missing")
            return None
        if only and not fits and field in info.data:
            raise ValueError(f"expected none with {field} {info.data[field]}, found {short(value)}")
        return handler(value)

    return WrapValidator(checked)


def all_different(values: tuple) -> tuple:
    """Give the values.

    Raises
    ------
    ValueError
        If one is there twice.
    """
    if twice := next((one for one in values if values.count(one) > 1), None):
        raise ValueError(f"expected no two alike, found {twice} again")
    return values


def increasing(values: tuple) -> tuple:
    """Give the values.

    Raises
    ------
    ValueError
        If one is not above the one before it.
    """
    if list(values) != sorted(set(values)):
        raise ValueError(f"expected increasing numbers, found {short(values)}")
    return values


def problems(kind: type[Model], value: Any, source: str = "", *, whole: bool = True) -> list[str]:
    """Say in a line each what is wrong with what people wrote.

    Parameters
    ----------
    kind : type
        The model.
    value
        As YAML gives it.
    source : str, optional
        Name of the file, for the messages; without one they begin with the field.
    whole : bool, optional
        False: of a part of a file, to which no whole field need belong.

    Returns
    -------
    list of str
        Sorted; what is left to fill in comes last, in the file's order.
    """
    blank, found = blank_fields(value), []
    try:
        kind.model_validate(value)
    except ValidationError as error:
        for one in error.errors(include_url=False):
            place = _place(value, one)
            lacks = not whole and one["type"] == "missing" and len(place) == 1
            if not lacks and not any(place[: len(field)] == field for field in blank):
                found.append((place, one))
    lines = sorted({line for group in _by_value(found) for line in _lines(kind, *group)})
    for field in blank:
        spec = field_at(kind, field)[1]
        words = (spec and spec.description) or "a value"
        lines.append(_line(field, words, "nothing filled in yet"))
    return [one_line(f"{source}: {line}" if source else line) for line in lines]


def blank_fields(value: Any) -> list[tuple[str, ...]]:
    """List the fields of a file where something is left to fill in; a list is one field."""
    return list(dict.fromkeys(_blank_fields(value, ())))


def missing_fields(kind: type[Model], value: Any) -> list[tuple[str, ...]]:
    """List the fields that a model asks for and a value lacks."""
    try:
        kind.model_validate(value)
    except ValidationError as error:
        found = error.errors(include_url=False)
        return [_place(value, one) for one in found if one["type"] == "missing"]
    return []


def _blank_fields(value: Any, field: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    if isinstance(value, str) and value == FILL_IN:
        yield field
    elif isinstance(value, Mapping):
        for key, content in value.items():
            yield from _blank_fields(content, (*field, str(key)))
    elif isinstance(value, list | tuple):
        for content in value:
            yield from _blank_fields(content, field)


def _tuples(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _tuples(one) for key, one in value.items()}
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value


def _lists(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _lists(one) for key, one in value.items()}
    return list(map(_lists, value)) if isinstance(value, tuple) else value


def _place(value: Any, error: Mapping) -> tuple[str, ...]:
    """Keys down to a value that is wrong, without what pydantic says of members of unions."""
    kept, loc = [], error["loc"]
    for index, part in enumerate(loc):
        if isinstance(value, Mapping) and part in value:
            value = value[part]
        elif isinstance(value, list | tuple) and isinstance(part, int) and part < len(value):
            value = value[part]
        elif error["type"] != "missing" or index < len(loc) - 1:
            continue
        kept.append(str(part))
    return tuple(kept)


def field_at(kind: type[Model], place: Sequence[str]) -> tuple[list, FieldInfo | None]:
    """Give the types that the value at a place may have, and its field."""
    kinds, spec = [kind], None
    for part in place:
        below, spec = [], None
        for one in members(kinds):
            if isinstance(one, type) and issubclass(one, BaseModel):
                spec = one.model_fields.get(part, spec)
                below += [spec.annotation] if part in one.model_fields else []
            elif get_origin(one) in (dict, tuple):
                below.append(get_args(one)[-1 if get_origin(one) is dict else 0])
        kinds = below
    return list(members(kinds)), spec


def members(kinds: Sequence[Any]) -> Iterator[Any]:
    """Give the types behind unions and annotations."""
    for kind in kinds:
        if get_origin(kind) is Annotated:
            yield from members(get_args(kind)[:1])
        elif get_origin(kind) in (Union, UnionType):
            yield from members(get_args(kind))
        else:
            yield kind


def _by_value(found: Sequence[tuple[tuple[str, ...], Mapping]]) -> Iterator[tuple]:
    """Places and their errors, of a union's members those that came further."""
    groups: dict[tuple, list] = {}
    for place, error in found:
        groups.setdefault((place, error["loc"][-1:] == ("[key]",)), []).append(error)
    for (place, is_key), errors in groups.items():
        below = any(len(p) > len(place) and p[: len(place)] == place for p, _ in groups)
        if is_key or not (below and all(one["type"] in TYPES for one in errors)):
            yield place, errors


def _lines(kind: type[Model], place: tuple[str, ...], errors: Sequence[Mapping]) -> list[str]:
    """Lines for pydantic's errors of a value, without the file."""
    error = next((one for one in errors if one["type"] == "value_error"), errors[0])
    of, found, bounds = error["type"], error["input"], error.get("ctx", {})
    kinds, spec = field_at(kind, place)
    if of == "value_error":
        return [_own_line(place, one) for one in str(bounds["error"]).splitlines()]
    if error["loc"][-1:] == ("[key]",) and isinstance(found, str):
        place = place[:-1]
    elif error["loc"][-1:] == ("[key]",) or of == "invalid_key":
        return [_line(place, "a key in quotes", f"the bare {found}")]
    if of == "extra_forbidden":
        models = (k for k in field_at(kind, place[:-1])[0] if isinstance(k, type))
        known = {n for m in models if issubclass(m, BaseModel) for n in m.model_fields}
        return [_line(place, f"one of {_listed(known)}", place[-1])]
    if of == "missing":
        return [_line(place, "a value", "nothing")]
    words = [_expected(one["type"], one.get("ctx", {}), spec) for one in errors]
    words += ["null"] if NoneType in kinds else []
    return [_line(place, " or ".join(dict.fromkeys(words)), short(found))]


def _own_line(place: Sequence[str], words: str) -> str:
    """Line of a validator of ours, which says: [field: ]expected X, found Y."""
    if words.startswith("expected "):
        return f"{'.'.join(place) or 'content'}: {words}"
    return ".".join((*place, words))


def _expected(of: str, bounds: Mapping, spec: FieldInfo | None) -> str:
    if of in LIMITS:
        word, name = LIMITS[of]
        bound = bounds[name]
        return f"a number {word} {bound if isinstance(bound, int) else f'{bound:g}'}"
    if of == "literal_error":
        words = re.split(", | or ", bounds["expected"].replace("'", ""))
        return f"one of {_listed(words)}" if len(words) > 1 else words[0]
    if of in ("too_short", "too_long"):
        word, name = ("least", "min_length") if of == "too_short" else ("most", "max_length")
        return f"at {word} {bounds[name]} entries"
    if of == "string_too_short":
        return f"a text of at least {bounds['min_length']} characters"
    if of == "string_pattern_mismatch":
        words = (spec and spec.description) or f"a text like {bounds['pattern']}"
        return PATTERNS.get(bounds["pattern"], words)
    return TYPES.get(of, of.removesuffix("_type"))


def _line(place: Sequence[str], expected: str, found: str) -> str:
    return f"{'.'.join(place) or 'content'}: expected {expected}, found {found}"


def _listed(values: Any) -> str:
    return ", ".join(sorted(str(value) for value in values))


def short(value: Any) -> str:
    """Give a value as a message names it."""
    if isinstance(value, Mapping):
        return f"a mapping of {_listed(value) or 'nothing'}"
    text = " ".join(repr(_lists(value)).split())
    return text if len(text) <= LONGEST_VALUE else text[:LONGEST_VALUE] + "..."
