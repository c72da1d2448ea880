"""One indentation by many protocols: what captures share, where the probe goes, and the table."""

import json
import os
from types import SimpleNamespace

import pytest
import yaml
from palpate.workflow.configuration import open_run
from palpate.yaml_files import load_yaml
from settings import written
from thesis.options import StudyConfig
from validation import protocols
from virtual_lab.describe import object_text
from virtual_lab.rules import LabRules

BONDED, BESIDE, INCLINED = "glued_block", "01-a09", "02"


@pytest.fixture(scope="module")
def rules(root, tmp_path_factory):
    """The lab's rules as a run of `make protocols` sees them."""
    config = written(root)
    ours = yaml.safe_load((root / "config/protocols.yaml").read_text())
    config["paths"] |= ours["paths"] | {"raw": str(tmp_path_factory.mktemp("raw"))}
    places = ("sensors", "probes", "meshes", "lab")
    config["paths"] |= {name: str(root / config["paths"][name]) for name in places}
    before = os.getcwd()
    os.chdir(root)
    try:
        run = open_run(config, sources=["config/protocols.yaml"], project=root, kind=StudyConfig)
    finally:
        os.chdir(before)
    return LabRules(run)


def of(capture, name=BONDED):
    return SimpleNamespace(object=name, sensor="bumblebee", capture=capture)


def captures_of(rules, name):
    return sorted(c.capture for c in rules.run.simulated if c.object == name)


def test_all_protocols_but_two_share_the_mechanics(rules):
    steps = {c: rules.load_steps(of(c)) for c in captures_of(rules, BONDED)}
    own = {BESIDE, INCLINED}
    assert len(steps) == 12 and len({steps[c] for c in set(steps) - own}) == 1
    assert {c: steps[c].rpartition("/")[2] for c in own} == {
        BESIDE: f"contact-{BESIDE}.npz",
        INCLINED: f"contact-{INCLINED}.npz",
    }


def test_each_capture_has_its_motion_and_only_it(rules):
    plain = rules.recorded(of("01"))
    other = rules.recorded(of("01-a02"))
    assert other["motion"] == plain["motion"] | {"rest_s": 5.0}
    assert rules.recorded(of(BESIDE)) == plain
    # Background and description do not depend on a recording's motion.
    assert not {"motions", "pressed_at"} & set(rules.spec(of("01")))


def test_a_contact_beside_the_point_is_not_in_the_description(rules):
    declared = rules.place(of("01"))["position_m"]
    pressed = rules.place(of(BESIDE))["position_m"]
    assert [p - d for p, d in zip(pressed, declared, strict=True)] == pytest.approx([0.005, 0, 0])
    assert rules.mechanics(of(BESIDE))["points"][BESIDE]["position_m"] == pressed
    told = yaml.safe_load(object_text(rules.spec(of(BESIDE)), name=BONDED))
    assert set(told["points"]) == {"01", INCLINED}
    assert str(pressed[0]) not in json.dumps(told["points"])
    assert rules.place(of(INCLINED))["direction"] == told["points"][INCLINED]["direction"]


def test_the_table_says_what_holds(root, tmp_path):
    lab = load_yaml(root / "config/protocols_lab.yaml")
    for name, spec in lab["objects"].items():
        (tmp_path / "lab" / name).mkdir(parents=True)
        E, nu = (spec["material"][key] for key in ("youngs_modulus_pa", "poisson_ratio"))
        truth = {"youngs_modulus_pa": E, "poisson_ratio": nu}
        truth["reduced_modulus_pa"] = E / (1 - nu**2)
        (tmp_path / "lab" / name / "material.json").write_text(json.dumps(truth))
    for capture, shift in (("01", 1.0), ("01-a02", 1.2)):
        found = {
            key: {"value": shift * value, "low": 0.9 * shift * value, "high": 1.1 * shift * value}
            for key, value in truth.items()
        }
        (tmp_path / BONDED / "bumblebee" / capture).mkdir(parents=True)
        path = tmp_path / BONDED / "bumblebee" / capture / "direct.json"
        path.write_text(json.dumps(found))
    rows = protocols.protocols_table(lab, tmp_path).set_index(["object", "capture"])
    assert rows.loc[(BONDED, "01"), ["protocol", "holds"]].tolist() == ["plain", "yes"]
    assert rows.loc[(BONDED, "01-a02"), "protocol"] == "rest_s 5"
    assert rows.loc[(BONDED, "01-a02"), "holds"] == "no: E, nu, E*"
    assert rows.loc[(BONDED, "01"), "E [kPa]"] == "25 (22.5 to 27.5)"
    row = rows.loc[("loose_block", "01"), ["protocol", "holds"]]
    assert row.tolist() == ["unbonded", "rejected"]
    assert rows.loc[("bad_bench", "01-a01"), "protocol"] == "jolted_m, rig errors"
    assert rows["protocol"].is_unique
