"""Models of what people write: one line for each problem, and nothing converted in silence."""

from typing import Annotated, Literal

import pytest
from palpate.config.model import Count, FileName, Model, NotNegative, Positive, constant, problems
from pydantic import Field, model_validator


class Inner(Model):
    """A block in a block."""

    place_m: tuple[NotNegative, NotNegative] = (0.0, 1.0)
    rule: Literal["one", "two"] = "one"
    low: float = 0
    high: float = 1

    @model_validator(mode="after")
    def _in_order(self):
        if self.low >= self.high:
            raise ValueError(f"low: expected below high, {self.high:g}, found {self.low:g}")
        return self


class Outer(Model):
    """A block."""

    name: str = Field(min_length=1, description="a name of it")
    count: Count = Field(3, ge=1)
    edge_m: Positive | None = None
    share: Positive | tuple[Positive, Positive] = 1
    inner: Inner = Field(default_factory=Inner)
    points: dict[FileName, Inner] = Field(default_factory=dict)
    marks: Annotated[tuple[str, ...], Field(min_length=1)] = ("a",)
    flat: bool = True
    counts: tuple[Count, ...] = ()


LINES = [
    ({"count": 0}, "count: expected a number >= 1, found 0"),
    ({"count": 10**9}, "count: expected a number <= 1000000, found 1000000000"),
    ({"count": 2.5}, "count: expected an integer, found 2.5"),
    ({"count": 0.0}, "count: expected a number >= 1, found 0"),
    ({"count": float("nan")}, "count: expected an integer, found nan"),
    ({"count": True}, "count: expected an integer, found True"),
    ({"count": "3"}, "count: expected an integer, found '3'"),
    ({"edge_m": 0}, "edge_m: expected a number > 0 or null, found 0"),
    ({"edge_m": float("inf")}, "edge_m: expected a finite number or null, found inf"),
    ({"flat": 1}, "flat: expected a boolean, found 1"),
    ({"marks": []}, "marks: expected at least 1 entries, found []"),
    ({"marks": "ab"}, "marks: expected a list, found 'ab'"),
    ({"name": ""}, "name: expected a text of at least 1 characters, found ''"),
    ({"name": "FILL_IN"}, "name: expected a name of it, found nothing filled in yet"),
    ({"name": None}, "name: expected a text, found None"),
    ({"inner": {"rule": "three"}}, "inner.rule: expected one of one, two, found 'three'"),
    ({"inner": {"place_m": [1]}}, "inner.place_m.1: expected a value, found nothing"),
    ({"inner": {"place_m": [1, -1]}}, "inner.place_m.1: expected a number >= 0, found -1"),
    ({"inner": {"low": 2}}, "inner.low: expected below high, 1, found 2"),
    ({"inner": [1]}, "inner: expected a mapping, found [1]"),
    ({"points": {"p": {"x": 1}}}, "points.p.x: expected one of high, low, place_m, rule, found x"),
    ({"points": {1: {}}}, "points.1: expected a key in quotes, found the bare 1"),
    (
        {"points": {"P": {}}},
        "points: expected a name of small letters, digits and _, like elastic_02, found 'P'",
    ),
]


@pytest.mark.parametrize(("change", "line"), LINES)
def test_one_line_for_what_is_wrong(change, line):
    assert problems(Outer, {"name": "a"} | change, "f.yaml") == [f"f.yaml: {line}"]


def test_all_problems_at_once_and_what_is_missing():
    assert problems(Outer, {"kind": 2, "flat": 0}) == [
        "flat: expected a boolean, found 0",
        f"kind: expected one of {', '.join(sorted(Outer.model_fields))}, found kind",
        "name: expected a value, found nothing",
    ]
    with pytest.raises(ValueError, match="^content: expected a mapping, found 3$"):
        Outer.read(3)


def test_what_is_left_out_has_its_default_and_changes_are_checked():
    read = Outer.read({"name": "a", "inner": {"place_m": [2, 3]}, "share": [1, 2]})
    assert read == Outer(name="a", inner=Inner(place_m=(2, 3)), share=(1, 2))
    assert read.written()["inner"] == {"place_m": [2, 3], "rule": "one", "low": 0, "high": 1}
    assert read.changed(count=4).count == 4
    with pytest.raises(ValueError, match="^count: expected a number >= 1, found 0$"):
        read.changed(count=0)


def test_a_whole_number_may_be_written_with_a_point_where_an_integer_is_asked_for():
    read = Outer.read({"name": "a", "count": 640.0, "edge_m": 2.0, "counts": [3.0, 4]})
    assert read.written() | {"count": 640, "edge_m": 2.0} == read.written()
    assert [type(one) for one in (read.count, read.edge_m, *read.counts)] == [int, float, int, int]
    plain = Outer.plain({"points": {"p": {"low": 1.0}}, "count": 640.0, "edge_m": 2})
    assert repr(plain) == "{'points': {'p': {'low': 1.0}}, 'count': 640, 'edge_m': 2}"


class Fixed(Model):
    """A block with a constant."""

    share: float = constant(0.5, "of the whole")
    pair: tuple[float, float] = constant((0.0, 1.0), "of it")
    free: int = 3


def test_code_may_change_a_constant_and_files_may_not():
    assert Fixed(share=0.2).changed(share=0.3, free=4).share == 0.3
    assert Fixed.read({"share": 0.5, "pair": [0, 1]}) == Fixed()
    with pytest.raises(ValueError, match=r"^f.yaml: share: expected 0.5, .* fixed, found 0.2$"):
        Fixed.read({"share": 0.2}, "f.yaml")
    with pytest.raises(ValueError, match=r"^other: expected one of free, found other$"):
        Fixed.read({"other": 1})


def test_a_call_with_wrong_values_is_one_line_for_each():
    with pytest.raises(ValueError) as caught:
        Outer(name="a", count=0, sharp=1)
    assert str(caught.value).splitlines()[0] == "count: expected a number >= 1, found 0"
    assert str(caught.value).count("\n") == 1 and "pydantic" not in str(caught.value)
