"""Options: their defaults, what people write, what no option is; their page, links of all pages."""

import re

import pytest
import yaml
from palpate.commands.project import Project
from palpate.config.model import problems
from palpate.workflow.options import Config, as_asked, page, rows
from thesis.options import OF_STUDY, StudyConfig


def test_defaults_are_within_their_own_bounds():
    assert problems(StudyConfig, StudyConfig().written()) == []
    assert all(meaning and not meaning.endswith(".") for *_, meaning in rows(StudyConfig))


def test_the_projects_own_file_and_page_say_the_defaults(root):
    """config.yaml shows what a user may change; a value there that is another would hide."""
    assert (root / "docs/options.md").read_text() == page() + OF_STUDY, "make docs writes it"
    own = yaml.safe_load((root / "config/config.yaml").read_text())
    own["paths"]["lab"] = None
    assert Config.read(own) == Config()


def test_commands_read_a_runs_whole_configuration(tmp_path):
    """What it says of the study stays valid, and a misspelt option is named."""
    content = StudyConfig().written() | {"hertz": {"onset_force_n": 0.2}}
    assert Project(tmp_path, content).config(None).hertz.onset_force_n == 0.2
    content["tracking"]["aligment"] = {}
    line = "config.yaml: tracking.aligment: expected one of alignment, found aligment"
    with pytest.raises(ValueError, match=line):
        Project(tmp_path, content).config(None)


def test_links_lead_somewhere(root):
    lost = []
    for document in (root / "README.md", *(root / "docs").rglob("*.md")):
        links = re.findall(r"\]\(([^)\s]+)\)", document.read_text("utf-8"))
        places = (link.partition("#")[0] for link in links if "://" not in link)
        lost += [(document, one) for one in places if not (document.parent / one).exists()]
    assert not lost


@pytest.mark.parametrize(
    ("name", "value", "line"),
    [
        ("misfit_reach_m", 0.3, "misfit_reach_m: expected 0.04, which is fixed, found 0.3"),
        ("poison_ratio", 0.3, "poison_ratio: expected one of coarsest_vertices, completion,"),
    ],
)
def test_constants_of_a_tracker_are_not_offered(name, value, line):
    trackers = {"mine": {"kind": "elastic", "misfit_reach_m": 0.04, name: value}}
    (found,) = problems(StudyConfig, {"tracking": {"trackers": trackers}})
    assert line in found and ", misfit_reach_m" not in found


SAME = {"direct": {"fit": {"poisson_ratio": "abc"}}}


@pytest.mark.parametrize(
    ("given", "read"),
    [
        ({"hertz": {"onset_force_n": "6e-2"}}, {"hertz": {"onset_force_n": 0.06}}),
        ({"background": {"smallest_blob_px": "400.0"}}, {"background": {"smallest_blob_px": 400}}),
        ({"study": {"table_5_3_points": ["08"]}}, {"study": {"table_5_3_points": ["08"]}}),
        ({"paths": {"raw": "2.0", "lab": "null"}}, {"paths": {"raw": "2.0", "lab": None}}),
        (SAME, SAME),
        ({"seed": 7, "no_option": "1"}, {"seed": 7, "no_option": "1"}),
    ],
)
def test_numbers_within_braces_on_the_command_line(given, read):
    """Of which Snakemake makes texts."""
    assert as_asked(given, [StudyConfig]) == read
