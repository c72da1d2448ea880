"""The gate goes red where intervals miss beyond chance, sensors disagree or a modulus is off."""

import pandas as pd
import pytest
from palpate.modulus import LABELS, columns
from truth_gate import KNOWN, LAWS, RECORD, STEMS, check, digest, failures, meaning, read_record

ONE = "youngs_modulus"
ESTIMATE = {f"{stem}_covered": True for stem in STEMS.values()}
ESTIMATE |= {columns(n)[1]: 0.9 for n in LABELS} | {columns(n)[2]: 1.1 for n in LABELS}
ESTIMATE |= dict.fromkeys(LAWS, 0.1) | {f"{law}_std": 0.05 for law in LAWS}
ESTIMATE |= {f"known_{KNOWN}": 1.01, f"true_{KNOWN}": 1.0, "warnings": None}


@pytest.fixture
def record():
    """Five joint estimates and five captures of each, all right."""
    groups = [("block", "kinect"), ("block", "stereo"), ("ball", "kinect"), ("ball", "stereo")]
    groups += [("ear", "stereo")]
    rows = [
        {"object": name, "sensor": sensor, "recommended": joint} | ESTIMATE
        for name, sensor in groups
        for joint in (True, *[False] * 5)
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("change", "rows", "said"),
    [
        ({f"{ONE}_covered": False}, 1, None),
        ({f"{ONE}_covered": False}, 2, "2 of 25 recommended intervals miss: block kinect"),
        ({"force_law": -0.14}, 1, None),
        ({"force_law": -0.16}, 1, "block kinect force_law: found -0.16 +- 0.05"),
        ({f"known_{KNOWN}": 0.981}, 1, None),
        ({f"known_{KNOWN}": 0.979}, 1, f"block kinect {KNOWN} with nu and law known: -2.1 % off"),
        ({"warnings": "far"}, 1, "block kinect warning: far"),
        ({f"{ONE}_low_pa": 1.09}, 1, None),
        ({f"{ONE}_low_pa": 1.11}, 1, f"block: {ONE}_pa: the sensors' intervals exclude"),
    ],
)
def test_what_is_wrong_with_a_joint_estimate_is_named(record, change, rows, said):
    chosen = record[record["recommended"]].index[:rows]
    record.loc[chosen, list(change)] = list(change.values())
    found = failures(record)
    assert len(found) == (said is not None)
    assert not found or found[0].startswith(said)


@pytest.mark.parametrize(("count", "red"), [(2, False), (3, True)])
def test_of_single_captures_nine_of_ten_hold(record, count, red):
    record.loc[record[~record["recommended"]].index[:count], f"{ONE}_covered"] = False
    said = f"{ONE}_pa: 22 of 25 intervals of single captures hold"
    assert failures(record) == [said] * red


def test_the_committed_record_is_of_the_default_lab():
    record = read_record(RECORD)
    assert record["recommended"].sum() == 5 and not failures(record)


def test_a_record_of_other_code_or_none_is_named(tmp_path):
    path = tmp_path / "record.csv"
    assert [line[:30] for line in check(path)] == ["expected a record, found none:"]
    path.write_text(RECORD.read_text().replace("# code: ", "# code: 0"))
    assert [line[:30] for line in check(path)] == ["expected a record of this code"]


def test_the_digest_is_of_code_configuration_and_versions(tmp_path, monkeypatch):
    monkeypatch.setattr("truth_gate.PLACES", ("code", "config.yaml"))
    (tmp_path / "environment.lock").write_text("numpy==2.4.6 \\\n")
    with pytest.raises(ValueError, match="code: expected files"):
        digest(tmp_path)
    (tmp_path / "code").mkdir()
    found = []
    for name, text in (
        ("code/a.py", "x = 1\n"),
        ("config.yaml", "x: 1\n"),
        ("code/a.py", "x = 2\n"),
        ("config.yaml", "x: 2\n"),
        ("environment.lock", "numpy==2.4.7 \\\n"),
        ("code/a.py.orig", "x = 3\n"),
        ("config.yaml", "x: 2 # two\n"),
    ):
        (tmp_path / name).write_text(text)
        if (tmp_path / "config.yaml").is_file():
            found.append(digest(tmp_path))
    assert len(set(found[:4])) == 4 and len(set(found[3:])) == 1


@pytest.mark.parametrize(
    ("before", "after", "same"),
    [
        ('"""Said."""\nx = 1\n', "# why\nx = 1\n", True),
        ("x = 1\n", "x = 2\n", False),
        ("def f():\n    '''Said.'''\n    return 1\n", "def f():\n\n    return 1  # one\n", True),
    ],
)
def test_comments_and_docstrings_are_no_other_code(tmp_path, before, after, same):
    each = []
    for text in (before, after):
        (tmp_path / "a.py").write_text(text)
        each.append(meaning(tmp_path / "a.py"))
    assert (each[0] == each[1]) is same
