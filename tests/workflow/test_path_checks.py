"""Folders of a run that none can have, and results where captures lie."""

import pytest
from palpate.workflow.configuration_checks import path_problems

PATHS = {
    "raw": "raw",
    "results": "results",
    "sensors": "s",
    "probes": "p",
    "meshes": "m",
    "lab": None,
}


def test_right_folders():
    assert path_problems(PATHS, "config.yaml") == []
    assert path_problems(PATHS | {"raw": "results/lab/raw"}, "config.yaml") == []


@pytest.mark.parametrize("place", ["raw", "./raw/", "results/../raw", "raw/foam_block", "s/a"])
def test_results_where_people_keep_theirs(place):
    (line,) = path_problems(PATHS | {"results": place}, "config.yaml")
    assert line.startswith("config.yaml: paths.results: expected a folder outside paths.")
    assert line.endswith(f"found {place}")


def test_results_in_a_linked_raw(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raw").mkdir()
    (tmp_path / "results").symlink_to("raw")
    assert len(path_problems(PATHS, "config.yaml")) == 1


@pytest.mark.parametrize("name", ["a\nb", "a\0b", "x" * 5000, "\x1b[31m"])
def test_names_that_no_folder_has(name):
    (line,) = path_problems(PATHS | {"raw": name}, "config.yaml")
    assert line.startswith("config.yaml: paths.raw: expected printable characters")
    assert line.isprintable()
