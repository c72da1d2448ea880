"""Options: what people write, its schema, and what takes a block apart know the same keys."""

import inspect
from dataclasses import dataclass, fields, is_dataclass
from typing import Literal

import jsonschema
import pytest
import yaml
from palpate.estimate.minimise.options import Minimise
from palpate.estimate.relaxation import relaxed_share
from palpate.options import Options, block, option, rows, schema_of
from palpate.run.options import Config, config_schema, filled
from palpate.run.options_page import options_page
from palpate.solid.options import IndentationTable
from palpate.solid.support import Support
from palpate.vision.clouds import object_cloud
from palpate.vision.options import Clouds
from thesis.options import Simulation
from virtual_lab.relaxation import relaxed_force

BLOCKS = {"simulation": Simulation}


@dataclass(frozen=True, kw_only=True)
class Inner(Options):
    """A block in a block."""

    place_m: tuple[float, float] = option((0.0, 1.0), "of it", least=0)
    rule: Literal["one", "two"] = option("one", "that holds")


@dataclass(frozen=True, kw_only=True)
class Outer(Options):
    """A block."""

    count: int = option(3, "of them", least=1)
    edge_m: float | None = option(None, "null: none", above=0)
    inner: Inner = block(Inner, "within")  # noqa: RUF009


@dataclass(frozen=True, kw_only=True)
class Named(Options):
    """A block that has to say something."""

    name: str = option(..., "of it")


def option_fits(kind, **value):
    try:
        return kind(**value)
    except ValueError as error:
        assert str(error).startswith(f"{next(iter(value))}: expected ")


def wrong(value):
    return [
        e.json_path for e in jsonschema.Draft202012Validator(schema_of(Outer)).iter_errors(value)
    ]


def test_what_is_left_out_has_its_default():
    read = Outer.read({"inner": {"place_m": [2, 3]}})
    assert read == Outer(inner=Inner(place_m=(2, 3)))
    assert read.written() == {
        "count": 3,
        "edge_m": None,
        "inner": {"place_m": [2, 3], "rule": "one"},
    }


@pytest.mark.parametrize(
    ("value", "place"),
    [
        ({"count": 0}, "$.count"),
        ({"count": 2.5}, "$.count"),
        ({"edge_m": 0}, "$.edge_m"),
        ({"inner": {"rule": "three"}}, "$.inner.rule"),
        ({"inner": {"place_m": [1]}}, "$.inner.place_m"),
        ({"inner": {"place_m": [1, -1]}}, "$.inner.place_m[1]"),
        ({"cuont": 2}, "$"),
    ],
)
def test_the_schema_refuses(value, place):
    assert wrong({}) == wrong({"edge_m": 2, "inner": {}}) == []
    assert wrong(value) == [place]


def test_what_is_made_without_a_schema_is_refused_too():
    with pytest.raises(ValueError, match="^count: expected at least 1, found 0$"):
        Outer(count=0)
    with pytest.raises(ValueError, match="^rule: expected one, two, found three$"):
        Inner(rule="three")
    with pytest.raises(ValueError, match="^place_m: expected 2 each at least 0, found"):
        Inner(place_m=(1, -1))
    assert not option_fits(IndentationTable, poisson_ratios=())
    assert not option_fits(IndentationTable, poisson_ratios=(0.3,))
    assert not option_fits(Minimise, iterations=10**9)
    assert not option_fits(IndentationTable, growth=float("inf"))
    for wrong_kind in ({"count": "3"}, {"count": True}, {"edge_m": "1"}, {"inner": {"rule": 1}}):
        with pytest.raises(ValueError, match=r"^(count|edge_m|rule): expected .*, found"):
            Outer.read(wrong_kind)
    with pytest.raises(ValueError, match="^name: expected a text, found none$"):
        Named.read({})
    with pytest.raises(ValueError, match="bounds: expected some of .*, found larger"):
        option(1, "wrong", larger=2)


def test_rows_document_each():
    assert list(rows(Outer)) == [
        ("count", "3", "at least 1", "of them"),
        ("edge_m", "null", "above 0 or null", "null: none"),
        ("inner.place_m", "0, 1", "2 each at least 0", "of it"),
        ("inner.rule", "one", "one, two", "that holds"),
    ]


def test_defaults_fit_their_own_schema():
    full = filled({}, BLOCKS)
    assert not list(jsonschema.Draft202012Validator(config_schema(BLOCKS)).iter_errors(full))
    assert all(meaning and not meaning.endswith(".") for *_, meaning in rows(Config))


def test_the_projects_own_file_says_the_defaults(root):
    """config.yaml shows what a user may change; a value there that is another would hide."""
    own = yaml.safe_load((root / "config/config.yaml").read_text())
    own["paths"]["lab"] = None
    assert filled(own, {}) == filled({}, {})


def test_the_page_of_options_is_of_these(root):
    assert (root / "docs/options.md").read_text() == options_page(), "make docs writes it"


# Block, and what takes it.
TAKEN = [
    ("object support", Support),
    ("lab objects.*.material.relaxation", relaxed_force),
    ("lab objects.*.material.relaxation", relaxed_share),
]


def schema_at(root, place):
    """Schema of a block, by the schema's name and the block's place."""
    name, _, keys = place.partition(" ")
    path = root / f"workflow/scripts/palpate/schemas/{name}.schema.yaml"
    schema = found = yaml.safe_load(path.read_text())
    for key in keys.split("."):
        found = found["additionalProperties"] if key == "*" else found["properties"][key]
        while "$ref" in found:
            found = schema["$defs"][found["$ref"].rpartition("/")[2]]
    return found


def parameters(taker):
    """All that can be given by its name alone, and what has to be."""
    known = inspect.signature(taker).parameters
    if is_dataclass(taker):
        names = {field.name for field in fields(taker)}
    else:
        names = {n for n, p in known.items() if p.kind is p.KEYWORD_ONLY}
    return names, {n for n in names if known[n].default is inspect.Parameter.empty}


@pytest.mark.parametrize(("place", "taker"), TAKEN, ids=[t[1].__name__ for t in TAKEN])
def test_what_a_block_may_say_is_what_is_taken(root, place, taker):
    found, (known, needed) = schema_at(root, place), parameters(taker)
    assert found["additionalProperties"] is False
    assert set(found["properties"]) <= known
    assert needed <= set(found["required"])


def test_what_is_handed_on_whole_is_what_is_taken():
    """Options that a step takes by their names; all of them are there, by their defaults."""
    known, needed = parameters(object_cloud)
    assert needed == known == set(Clouds().written())
