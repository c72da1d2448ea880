"""Base of all options and specifications, and the messages about what people write."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import NoneType, UnionType
from typing import Annotated, Any, Self, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, model_validator
from pydantic.fields import FieldInfo
from pydantic.functional_validators import AfterValidator, WrapValidator
from pydantic_core import PydanticKnownError

from palpate.yaml_files import one_line

# Stands for what must be filled in; no model lets it through.
FILL_IN = "FILL_IN"
# Default of a field that `with_others` may ask for.
ABSENT = "left out"
LONGEST_VALUE = 60
# Context of a validation: what is validated was written by people.
FROM_PEOPLE = "from people"
MOST_COUNTED = 1_000_000
Count = Annotated[int, Field(le=MOST_COUNTED)]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
# Metres, of lengths on an object: millimetres taken for metres are far beyond.
Length = Annotated[float, Field(gt=0, le=0.2)]
Vector = tuple[float, float, float]
# Names that results' files are called by, and names of objects.
FILE_NAME, OBJECT_NAME = "^[a-z][a-z0-9_]*$", "^[A-Za-z0-9][A-Za-z0-9_]*$"
FileName = Annotated[str, Field(pattern=FILE_NAME)]
ObjectName = Annotated[str, Field(pattern=OBJECT_NAME)]
# Poisson's ratios that linear elasticity has.
Ratio = Annotated[float, Field(ge=0, lt=0.5)]

# What is expected, by a pattern or the type of pydantic's error, with its bounds.
EXPECTED = {
    "float_type": "a number",
    "int_type": "an integer",
    "bool_type": "a boolean",
    "string_type": "a text",
    "tuple_type": "a list",
    "model_type": "a mapping",
    "dict_type": "a mapping",
    "finite_number": "a finite number",
    "missing": "a value",
    "greater_than_equal": "a number >= {ge}",
    "less_than_equal": "a number <= {le}",
    "greater_than": "a number > {gt}",
    "less_than": "a number < {lt}",
    "too_short": "at least {min_length} entries",
    "too_long": "at most {max_length} entries",
    "string_too_short": "a text of at least {min_length} characters",
    FILE_NAME: "a name of small letters, digits and _, like elastic_02",
    OBJECT_NAME: "a name of letters, digits and _, like red_sponge",
}


class _OneLineEach(type(BaseModel)):
    """What is wrong with a call's values is reported as of a file's."""

    def __call__(cls, *args: Any, **values: Any) -> Any:
        try:
            return super().__call__(*args, **values)
        except ValidationError:
            raise ValueError("\n".join(problems(cls, values, context=None))) from None


class Model(BaseModel, metaclass=_OneLineEach):
    """Frozen values that people may write; a list is a tuple, and nothing is converted besides."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    @model_validator(mode="wrap")
    @classmethod
    def _as_written(cls, value: Any, handler: Callable, info: ValidationInfo) -> Self:
        """Lists become tuples; a whole number stays as it is written, or becomes an integer."""
        value = _each(value, tuple, [cls])
        made = handler(value)
        for name, one in value.items() if isinstance(value, Mapping) else ():
            now = made.__dict__.get(name)
            if isinstance(now, float | tuple) and now == one:
                made.__dict__[name] = one
        faults = list(made.conflicts())
        for name, field in cls.model_fields.items() if info.context is FROM_PEOPLE else ():
            if field.frozen and (found := getattr(made, name)) != field.default:
                faults.append((name, f"{short(field.default)}, which is fixed", short(found)))
        lines = [f"{field}: expected {x}, found {y}" for field, x, y in faults]
        if lines:
            raise ValueError("\n".join(line.removeprefix(": ") for line in lines))
        return made

    def conflicts(self) -> Iterable[tuple[str, str, object]]:
        """Give what does not go together: a field, or none; what is expected, and what is found."""
        return ()

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
        return type(self)(**dict(self) | changes)

    def written(self) -> dict:
        """Give all values as people write them."""
        return _each(self.model_dump(), list)

    @classmethod
    def plain(cls, value: Mapping) -> dict:
        """Give what people wrote, with integers for 640.0 where integers are asked for."""
        return _each(value, list, [cls])


def option(default: Any = ..., meaning: str | None = None, **bounds: Any) -> Any:
    """Field of a model: its default (``...``: to be given), its meaning, and pydantic's bounds.

    None where the type has none: may be left out. ``examples``: what a file to fill in has there.
    A long meaning may stand below the field instead (pydantic's ``use_attribute_docstrings``).
    """
    return Field(default, description=meaning, **bounds)


def constant(default: Any, meaning: str, **bounds: Any) -> Any:
    """Field like an `option` that code may give another value, and no file."""
    return option(default, meaning, frozen=True, **bounds)


def with_others(field: str, *values: str, needed: bool = True, only: bool = True) -> Callable:
    """Give what makes fields that an earlier one's values ask for: needed then, and only then.

    Bounds and checks (`where`) are the field's, not its type's, so that it may be left out.
    """

    def checked(value: Any, handler: Callable, info: ValidationInfo) -> Any:
        fits = info.data.get(field) in values
        if value is ABSENT:
            if fits and needed:
                raise PydanticKnownError("missing")
            return None
        if only and not fits and field in info.data:
            raise ValueError(f"expected none with {field} {info.data[field]}, found {short(value)}")
        return handler(value)

    def beside(meaning: str | None = None, checks: Sequence = (), **bounds: Any) -> Any:
        made = option(ABSENT, meaning, validate_default=True, **bounds)
        made.metadata += [*checks, WrapValidator(checked)]
        return made

    return beside


def where(holds: Callable, expected: str, found: Callable | None = None) -> AfterValidator:
    """Of values for which something holds; others are not what is expected, but what is found."""

    def checked(value: Any) -> Any:
        if not holds(value):
            raise ValueError(f"expected {expected}, found {(found or short)(value)}")
        return value

    return AfterValidator(checked)


all_different = where(
    lambda values: len(set(values)) == len(values),
    "no two alike",
    lambda values: f"{next(one for one in values if values.count(one) > 1)} again",
)
increasing = where(lambda values: list(values) == sorted(set(values)), "increasing numbers")


def problems(
    kind: type[Model], value: Any, source: str = "", *, context: object = FROM_PEOPLE
) -> list[str]:
    """Say in a line each what is wrong with what people wrote.

    Parameters
    ----------
    kind : type
        The model.
    value
        As YAML gives it.
    source : str, optional
        Name of the file, for the messages; without one they begin with the field.
    context : optional
        None: constants may have other values.

    Returns
    -------
    list of str
        Sorted; what is left to fill in comes last, in the file's order.
    """
    blank, groups = blank_fields(value), {}
    for place, error in _errors(kind, value, context):
        if not any(place[: len(field)] == field for field in blank):
            is_key = error["loc"][-1:] == ("[key]",)
            groups.setdefault((place, is_key), []).append(error)
    lines = set()
    for (place, is_key), errors in groups.items():
        # Of a union's members those count that came further.
        if is_key or not any(len(p) > len(place) and p[: len(place)] == place for p, _ in groups):
            lines |= set(_lines(kind, place, errors, is_key))
    lines = sorted(lines)
    for field in blank:
        spec = field_at([kind], field)[1]
        words = (spec and spec.description) or "a value"
        lines.append(_line(field, f"expected {words}, found nothing filled in yet"))
    return [one_line(f"{source}: {line}" if source else line) for line in lines]


def blank_fields(value: Any, place: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """List the fields of a file where something is left to fill in; a list is one field."""
    if isinstance(value, Mapping):
        parts = [((*place, str(key)), content) for key, content in value.items()]
    elif isinstance(value, list | tuple):
        parts = [(place, content) for content in value]
    else:
        return [place] if isinstance(value, str) and value == FILL_IN else []
    return list(dict.fromkeys(field for at, one in parts for field in blank_fields(one, at)))


def missing_fields(kind: type[Model], value: Any) -> list[tuple[str, ...]]:
    """List the fields that a model asks for and a value lacks."""
    return [place for place, error in _errors(kind, value) if error["type"] == "missing"]


def _errors(kind: type[Model], value: Any, context: object = None) -> list[tuple]:
    """Places and pydantic's errors of what is there."""
    try:
        kind.model_validate(value, context=context)
    except ValidationError as error:
        return [(_place(value, one), one) for one in error.errors(include_url=False)]
    return []


def _each(value: Any, kind: type, types: Sequence[Any] = ()) -> Any:
    """The same with lists, or tuples, in the place of both, and integers for 640.0 by the types."""
    if isinstance(value, Mapping):
        return {key: _each(one, kind, field_at(types, [key])[0]) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return kind(_each(one, kind, field_at(types, [0])[0]) for one in value)
    whole = isinstance(value, float) and value.is_integer() and abs(value) < 2**53
    return int(value) if whole and int in types and float not in types else value


def _place(value: Any, error: Mapping) -> tuple[str, ...]:
    """Keys down to a value that is wrong, without what pydantic says of members of unions."""
    kept, loc = [], error["loc"]
    for part in loc:
        try:
            value = value[part]
        except (KeyError, IndexError, TypeError):
            if error["type"] != "missing" or part is not loc[-1]:
                continue
        kept.append(str(part))
    return tuple(kept)


def field_at(kinds: Sequence[Any], place: Sequence[Any]) -> tuple[list, FieldInfo | None]:
    """Give the types that a place in a value of some types may have, and its field."""
    spec = None
    for part in place:
        below, spec = [], None
        for one in kinds:
            if part in (fields := getattr(one, "model_fields", {})):
                spec = fields[part]
                below.append(spec.annotation)
            elif get_origin(one) in (dict, tuple):
                below.append(get_args(one)[-1 if get_origin(one) is dict else 0])
        kinds = list(members(below))
    return kinds, spec


def members(kinds: Sequence[Any]) -> Iterator[Any]:
    """Give the types behind unions and annotations."""
    for kind in kinds:
        parts = get_args(kind)[: 1 if get_origin(kind) is Annotated else None]
        inside = get_origin(kind) in (Annotated, Union, UnionType)
        yield from members(parts) if inside else [kind]


def _lines(kind: type[Model], place: tuple, errors: Sequence[Mapping], is_key: bool) -> list[str]:
    """Lines for pydantic's errors of a value, without the file."""
    error = next((one for one in errors if one["type"] == "value_error"), errors[0])
    of, value = error["type"], error["input"]
    if of == "value_error":
        return [_line(place, one) for one in str(error["ctx"]["error"]).splitlines()]
    if of == "invalid_key" or (is_key and not isinstance(value, str)):
        expected, found = "a key in quotes", f"the bare {value}"
    elif of == "extra_forbidden":
        fields = (getattr(one, "model_fields", {}) for one in field_at([kind], place[:-1])[0])
        known = {name for found in fields for name, one in found.items() if not one.frozen}
        expected, found = f"one of {', '.join(sorted(known))}", place[-1]
    else:
        words = [_expected(one["type"], one.get("ctx", {})) for one in errors]
        words += ["null"] if NoneType in field_at([kind], place)[0] else []
        expected, found = " or ".join(dict.fromkeys(words)), short(value)
        found, place = "nothing" if of == "missing" else found, place[: -1 if is_key else None]
    return [_line(place, f"expected {expected}, found {found}")]


def _line(place: Sequence[str], words: str) -> str:
    """Line about a place, of: [field: ]expected X, found Y."""
    if words.startswith("expected "):
        return f"{'.'.join(place) or 'content'}: {words}"
    return ".".join((*place, words))


def _expected(of: str, bounds: Mapping) -> str:
    if of == "literal_error":
        words = re.split(", | or ", bounds["expected"].replace("'", ""))
        return f"one of {', '.join(sorted(words))}" if len(words) > 1 else words[0]
    said = {name: f"{b:g}" if isinstance(b, float) else b for name, b in bounds.items()}
    return EXPECTED.get(bounds.get("pattern", of), of.removesuffix("_type")).format(**said)


def short(value: Any) -> str:
    """Give a value as a message names it."""
    if isinstance(value, Mapping):
        return f"a mapping of {', '.join(sorted(map(str, value))) or 'nothing'}"
    text = " ".join(repr(_each(value, list)).split())
    return text if len(text) <= LONGEST_VALUE else text[:LONGEST_VALUE] + "..."
