"""Messages about YAML that people write."""

import pytest
import yaml
from palpate.capture.schema import load_yaml, validate


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
            "k.yaml: depth.encoding: expected millimetre, found 'kinect_disparity'",
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
    problems = validate(spec, root / "config/schemas/sensor.schema.yaml", "k.yaml")
    assert len(problems) == 1
    assert problems[0].startswith(line)


def test_all_committed_files_fit_their_schemas(root):
    for kind in ("sensor", "probe"):
        for path in (root / f"config/{kind}s").glob("*.yaml"):
            schema = root / f"config/schemas/{kind}.schema.yaml"
            assert validate(load_yaml(path), schema, path.name) == []


def test_lab_refuses_an_incompressible_material(root):
    lab = load_yaml(root / "config/lab.yaml")
    lab["objects"]["foam_block"]["material"]["poisson_ratio"] = 0.5
    problems = validate(lab, root / "config/schemas/lab.schema.yaml", "lab.yaml")
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
