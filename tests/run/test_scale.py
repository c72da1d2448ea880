"""The tree that the bench of many objects reads holds valid captures."""

import sys
from pathlib import Path

import pytest
import yaml
from palpate.capture.check import check_object

sys.path.append(str(Path(__file__).resolve().parents[1]))

from bench_scale import write_tree


@pytest.fixture
def specs(root):
    def named(folder):
        return {path.stem: yaml.safe_load(path.read_text()) for path in folder.glob("*.yaml")}

    return named(root / "tests/sample/sensors"), named(root / "config/probes")


def test_nothing_is_wrong_with_it(specs, tmp_path):
    assert write_tree(tmp_path / "raw", 2, points=("01", "02")) == 8
    for name in ("object_0000", "object_0001"):
        assert check_object(tmp_path / "raw" / name, *specs) == []


def test_unopened_tables_are_missed_by_name(specs, tmp_path):
    write_tree(tmp_path / "raw", 1, points=("01",))
    folder = tmp_path / "raw/object_0000"
    missing = folder / "kinect/01/force.csv"
    missing.unlink()
    line = f"{missing}: file: expected a CSV table, found nothing"
    assert check_object(folder, *specs, files=False) == [line]
    assert line in check_object(folder, *specs)


def test_a_cut_image_is_left_to_the_full_check(specs, tmp_path):
    write_tree(tmp_path / "raw", 1, points=("01",))
    image = tmp_path / "raw/object_0000/kinect/01/depth/000020.png"
    content = image.read_bytes()
    image.unlink()
    image.write_bytes(content[:-20])
    assert check_object(tmp_path / "raw/object_0000", *specs, files=False) == []
    assert "truncated" in check_object(tmp_path / "raw/object_0000", *specs)[0]


def test_more_names_than_a_file_can_have(tmp_path):
    with pytest.raises(ValueError, match="objects: expected at most 3333, found 4000"):
        write_tree(tmp_path / "raw", 4000)
