"""Blocks of the configuration against what takes them apart: neither knows a key alone."""

import inspect
from dataclasses import fields, is_dataclass

import pytest
import yaml
from palpate.estimate.direct.relaxation import relaxed_share
from palpate.estimate.direct.sample_heights import ObservationOptions
from palpate.estimate.hertz.mixture import Beliefs
from palpate.estimate.minimise.problem import pose_problem
from palpate.run.trackers import NEEDED
from palpate.solid.support import Support
from palpate.surface.alignment import align_capture
from palpate.surface.checks import AlignmentLimits
from palpate.surface.data_points import TrackerOptions
from palpate.surface.elastic import ElasticOptions
from palpate.surface.pose import align_rigidly
from palpate.vision.clouds import object_cloud
from palpate.vision.force import frame_wrenches
from palpate.vision.foreground import Classifier
from palpate.vision.kalman import filter_tip
from palpate.vision.support_plane import fit_support_plane
from thesis.chapter5.rigid_slide import align_to_nearest
from virtual_lab.relaxation import relaxed_force

LOAD = {"force_rule", "turn_force", "leave_out_radii", "strain"}
# Block, what takes it, what that is given besides, and keys of the block that others take.
TAKEN = [
    ("config background", Classifier, set(), {"false_positive_rate", "largest_shift_px"}),
    ("config support_plane", fit_support_plane, {"rng"}, set()),
    ("config probe_pose.filter", filter_tip, set(), set()),
    ("config force", frame_wrenches, {"up", "clock_offset_s"}, {"clock_offset_std_s"}),
    ("config clouds", object_cloud, set(), set()),
    ("config tracking.alignment", align_capture, set(), {"limits"}),
    ("config tracking.alignment", align_rigidly, {"standing"}, {"limits"}),
    ("config tracking.alignment", align_to_nearest, set(), {"limits"}),
    ("config tracking.alignment.limits", AlignmentLimits, set(), set()),
    ("config solid", pose_problem, {"indenter_radius_m", *LOAD}, set()),
    ("config hertz.relaxation", Beliefs, set(), set()),
    ("config direct.observation", ObservationOptions, set(), {"clear_windows"}),
    ("config simulation.tracking", TrackerOptions, set(), set()),
    ("config simulation.support", Support, set(), set()),
    ("object support", Support, set(), set()),
    ("lab objects.*.material.relaxation", relaxed_force, set(), set()),
    ("lab objects.*.material.relaxation", relaxed_share, set(), set()),
]


@pytest.fixture(scope="module")
def block(root):
    """Schema of a block, by the schema's name and the block's place."""

    def at(place):
        name, _, keys = place.partition(" ")
        schema = yaml.safe_load((root / f"config/schemas/{name}.schema.yaml").read_text())
        found = schema
        for key in keys.split("."):
            found = found["additionalProperties"] if key == "*" else found["properties"][key]
            while "$ref" in found:
                found = schema["$defs"][found["$ref"].rpartition("/")[2]]
        return found

    return at


def parameters(taker):
    """All that can be given by its name alone, and what has to be."""
    if is_dataclass(taker):
        names = {field.name for field in fields(taker)}
    else:
        names = {n for n, p in _signature(taker).items() if p.kind is p.KEYWORD_ONLY}
    return names, {n for n in names if _signature(taker)[n].default is inspect.Parameter.empty}


def _signature(taker):
    return inspect.signature(taker).parameters


@pytest.mark.parametrize(
    ("place", "taker", "given", "left"), TAKEN, ids=[f"{t[0]}-{t[1].__name__}" for t in TAKEN]
)
def test_what_a_block_may_say_is_what_is_taken(block, place, taker, given, left):
    found, (known, needed) = block(place), parameters(taker)
    assert found["additionalProperties"] is False
    assert given <= known
    assert set(found["properties"]) - left <= known - given
    assert needed - given <= set(found["required"]) - left


def test_trackers_are_asked_for_what_they_take(block):
    known = set(block("config tracking.trackers.*")["properties"])
    for kind, options in (("study", TrackerOptions), ("elastic", ElasticOptions)):
        assert parameters(options)[0] <= set(NEEDED[kind]) <= known


def test_changes_are_of_what_there_is_to_change(block):
    options, solid = (set(block(f"config {name}")["properties"]) for name in ("minimise", "solid"))
    assert set(block("config minimise.steps.*")["properties"]) <= options | solid | {"tracker"}
    assert set(block("config minimise.objects.*")["properties"]) <= options
    simulation = block("config simulation")["properties"]
    known = {"cuts", "corners", *simulation["tracking"]["properties"]}
    assert set(simulation["variants"]["additionalProperties"]["properties"]) <= known
