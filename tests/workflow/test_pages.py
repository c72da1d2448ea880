"""The report that a run makes, in a real browser, whole without a network."""

import re

import pytest
from browser import browser, missing
from sample_run import SAMPLE, ran

pytestmark = pytest.mark.workflow
in_a_browser = pytest.mark.skipif(missing() is not None, reason=missing() or "")

# Schemes that stay on the machine.
AT_HOME = re.compile(r"^(file|data|blob|chrome|chrome-untrusted|about):")
NAMED = "return [...document.querySelectorAll('a')].map((link) => link.textContent.trim())"
CLICK = """
const link = [...document.querySelectorAll("a")]
  .find((one) => one.textContent.trim() === arguments[0]);
if (link) link.click();
return Boolean(link);
"""
CLICK_IN_ROW = """
const row = [...document.querySelectorAll("tbody tr")]
  .find((one) => one.textContent.startsWith(arguments[0]));
const links = row ? [...row.querySelectorAll("a")] : [];
if (links.length) links[arguments[1]].click();
return links.length > 0;
"""


@pytest.fixture(scope="module")
def made(copy):
    """Folder of the sample's results, its report among them."""
    style = ("--report-stylesheet", "workflow/report/style.css")
    ran(copy, *SAMPLE, *style, "--report", "results/sample/report.html")
    return copy / "results/sample"


@pytest.fixture
def report(made, tmp_path):
    """The report in a window that has no errors and asks for nothing from elsewhere."""
    with browser(tmp_path) as window:
        window.requests()
        window.open(made / "report.html")
        window.until("return document.querySelectorAll('#rulegraph canvas, #rulegraph svg').length")
        yield window
        assert window.errors() == []
        assert [url for url in window.requests() if not AT_HOME.match(url)] == []


def test_pages_say_that_captures_are_simulated(made):
    text = (made / "objects.html").read_text(encoding="utf-8")
    assert text.count('"provenance": "simulated"') == 2 and "of the virtual lab" in text
    assert "simulated" in (made / "pages/table_5_3.html").read_text(encoding="utf-8")
    assert "seed: " in (made / "configuration.md").read_text(encoding="utf-8")


@in_a_browser
def test_the_report_lists_chapters_and_opens_a_figure_and_a_table(report):
    assert "Foam block" in report.run("return document.querySelector('.estimates').textContent")
    names = report.run(NAMED)
    assert {"3 Models and simulation", "4 Seeing", "5 Experiments", "This run"} <= set(names)
    assert report.run(CLICK, "5 Experiments")
    report.until(CLICK_IN_ROW, "Figure 5.\u200a2:", 0)
    report.until("return [...document.images].some((image) => image.naturalWidth > 1000)")
    report.until(CLICK_IN_ROW, "Figure 5.\u200a2:", 1)
    report.until("return document.body.textContent.includes('the fit of Eq. 5.1')")
    assert "(simulated)" in report.run("return document.body.textContent")


@in_a_browser
def test_the_report_opens_a_page_of_the_run(report):
    assert report.run(CLICK, "This run")
    report.until(CLICK_IN_ROW, "Summary", 0)
    report.until("return document.querySelector('iframe')")
