"""Options: what people write, its models, and what takes a block apart know the same keys."""

import inspect
from dataclasses import fields, is_dataclass
from typing import Literal

import pytest
import yaml
from palpate.config.model import Count, Model, NotNegative, Positive, option
from palpate.config.object import SupportSpec
from palpate.config.page import rows
from palpate.estimate.relaxation import relaxed_share
from palpate.solid.support import Support
from palpate.vision.clouds import object_cloud
from palpate.vision.options import Clouds
from palpate.workflow.options import Config, config_problems, filled, page
from thesis.options import Simulation
from virtual_lab.relaxation import relaxed_force
from virtual_lab.specification import Material

BLOCKS = {"simulation": Simulation}


def test_the_page_has_each_option_with_what_is_allowed():
    class Outer(Model):
        """A block."""

        edge_m: Positive | None = option(None, "null: none")
        place_m: tuple[NotNegative, NotNegative] = option((0.0, 1.0), "of it")
        names: tuple[str, ...] = option((), "of them", min_length=1)
        rule: Literal["one", "two"] = option("one", "that holds")
        count: Count = option(..., "of them", ge=1)

    assert list(rows(Outer)) == [
        ("edge_m", "null", "above 0 or null", "null: none"),
        ("place_m", "0, 1", "2 each at least 0", "of it"),
        ("names", "none", "1 or more, each a text", "of them"),
        ("rule", "one", "one, two", "that holds"),
        ("count", "to be given", "at least 1", "of them"),
    ]


def test_defaults_are_within_their_own_bounds():
    assert config_problems(filled({}, BLOCKS), BLOCKS, "") == []
    assert all(meaning and not meaning.endswith(".") for *_, meaning in rows(Config))


def test_the_projects_own_file_says_the_defaults(root):
    """config.yaml shows what a user may change; a value there that is another would hide."""
    own = yaml.safe_load((root / "config/config.yaml").read_text())
    own["paths"]["lab"] = None
    assert filled(own, {}) == filled({}, {})


def test_the_page_of_options_is_of_these(root):
    assert (root / "docs/options.md").read_text() == page(), "make docs writes it"


# Block, and what takes it.
RELAXATION = Material.model_fields["relaxation"].annotation
TAKEN = [(SupportSpec, Support), (RELAXATION, relaxed_force), (RELAXATION, relaxed_share)]


def parameters(taker):
    """All that can be given by its name alone, and what has to be."""
    known = inspect.signature(taker).parameters
    if is_dataclass(taker):
        names = {field.name for field in fields(taker)}
    else:
        names = {n for n, p in known.items() if p.kind is p.KEYWORD_ONLY}
    return names, {n for n in names if known[n].default is inspect.Parameter.empty}


@pytest.mark.parametrize(("block", "taker"), TAKEN, ids=[t[1].__name__ for t in TAKEN])
def test_what_a_block_may_say_is_what_is_taken(block, taker):
    known, needed = parameters(taker)
    assert set(block.model_fields) <= known
    assert needed <= {name for name, field in block.model_fields.items() if field.is_required()}


def test_what_is_handed_on_whole_is_what_is_taken():
    """Options that a step takes by their names; all of them are there, by their defaults."""
    known, needed = parameters(object_cloud)
    assert needed == known == set(Clouds().written())
