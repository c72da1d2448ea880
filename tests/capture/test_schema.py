"""Messages about YAML that people write."""

import re

import pytest
import yaml
from palpate.capture.schema import SCHEMAS, load_yaml, validate


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (
            lambda s: s["color"].update(fx_px="abc"),
            "k.yaml: color.fx_px: expected a number, found 'abc'",
        ),
        (
            lambda s: s["color"].update(fx_px=-1),
            "k.yaml: color.fx_px: expected a number >= 10, found -1",
        ),
        (lambda s: s.pop("range_m"), "k.yaml: range_m: expected a value, found nothing"),
        (
            lambda s: s.update(kind="sonar"),
            "k.yaml: kind: expected one of depth, stereo, structured_light",
        ),
        (
            lambda s: s["depth"].pop("baseline_m"),
            "k.yaml: depth.baseline_m: expected a value, found nothing",
        ),
        (lambda s: s.pop("depth"), "k.yaml: depth: expected a value, found nothing"),
        (
            lambda s: s.update(kind="stereo"),
            "k.yaml: stereo: expected a value, found nothing",
        ),
        (
            lambda s: s.update(kind="depth"),
            "k.yaml: depth.encoding: expected one of counts, millimetre, found 'kinect_disparity'",
        ),
        (
            lambda s: s["color"].update(fx_px=float("inf")),
            "k.yaml: color.fx_px: expected a finite number, found inf",
        ),
        (
            lambda s: s["color"]["distortion"].__setitem__(1, float("nan")),
            "k.yaml: color.distortion.1: expected a finite number, found nan",
        ),
    ],
)
def test_one_clear_line_for_a_sensor(root, sensors, change, line):
    spec = yaml.safe_load(yaml.safe_dump(sensors["kinect"]))
    change(spec)
    problems = validate(spec, SCHEMAS / "sensor.schema.yaml", "k.yaml")
    assert len(problems) == 1
    assert problems[0].startswith(line)


def test_all_committed_files_fit_their_schemas(root):
    for kind in ("sensor", "probe"):
        for path in (root / f"config/{kind}s").glob("*.yaml"):
            schema = SCHEMAS / f"{kind}.schema.yaml"
            assert validate(load_yaml(path), schema, path.name) == []


def test_lab_refuses_an_incompressible_material(root):
    lab = load_yaml(root / "config/lab.yaml")
    lab["objects"]["foam_block"]["material"]["poisson_ratio"] = 0.5
    problems = validate(lab, SCHEMAS / "lab.schema.yaml", "lab.yaml")
    field = "objects.foam_block.material.poisson_ratio"
    assert problems == [f"lab.yaml: {field}: expected a number < 0.5, found 0.5"]


def test_duplicate_keys_and_tags_are_refused(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("a: 1\na: 2\n")
    with pytest.raises(ValueError, match="key a is given twice"):
        load_yaml(path)
    path.write_text("a: !!python/object/apply:os.getcwd []\n")
    with pytest.raises(ValueError, match="expected plain YAML"):
        load_yaml(path)


def laughs(rows):
    before = 'a0: &a0 ["ha"]\n'
    return before + "".join(
        f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, rows)
    )


def merges(rows):
    return "a0: &a0 {k: 1}\n" + "".join(
        f"a{k}: &a{k} {{<<: [*a{k - 1}, *a{k - 1}]}}\n" for k in range(1, rows)
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (laughs(12), "more than 100000 values"),
        (merges(40), "more than 100000 values"),
        ("a: &a [*a]\n", "or one that holds itself"),
        ("a: " + "[" * 20_000, "recursion"),
        ("a: !!python/object/apply:os.system ['ls']\n", "could not determine a constructor"),
        ("a: !!float abc\n", "abc"),
        ("a: !!bool maybe\n", "maybe"),
        ("a: 2020-13-45\n", "month"),
        (f"a: {'9' * 5000}\n", "4300"),
        ("a: 1\na: 2\n", "key a is given twice"),
        ("#" * 1_100_000, "expected YAML of at most 1000000 bytes, found 1100000"),
    ],
)
def test_yaml_that_is_more_than_plain_values(tmp_path, text, words):
    path = tmp_path / "object.yaml"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"object.yaml: file: expected ") as refused:
        load_yaml(path)
    assert words in str(refused.value)
    assert str(refused.value).isprintable()


def test_aliases_of_people_are_read(tmp_path):
    path = tmp_path / "lab.yaml"
    path.write_text("\ufeffa: &a {x: 1}\r\nb: *a\r\nc: {<<: *a, y: 2}\r\n")
    assert load_yaml(path) == {"a": {"x": 1}, "b": {"x": 1}, "c": {"x": 1, "y": 2}}


def test_a_pattern_holds_for_the_whole_text(root):
    schema = SCHEMAS / "object.schema.yaml"
    lines = validate({"object": "foam\n"}, schema, "object.yaml")
    assert any(
        line.startswith("object.yaml: object: expected a name of letters, digits and _, like")
        for line in lines
    )


def patterns(node):
    """Schemas below a schema that hold a text to a pattern."""
    if isinstance(node, dict):
        if isinstance(node.get("pattern"), str):
            yield node
        for below in node.values():
            yield from patterns(below)
    elif isinstance(node, list):
        for below in node:
            yield from patterns(below)


def test_patterns_are_told_in_words_with_an_example(root):
    read = [load_yaml(path) for path in sorted(SCHEMAS.glob("*.yaml"))]
    found = [one for schema in read for one in patterns(schema)]
    assert len(found) >= 4
    for one in found:
        words, _, example = one["description"].rpartition(", like ")
        assert words.startswith("a name of ")
        assert re.fullmatch(one["pattern"], example)
