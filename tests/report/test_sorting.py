"""The table of all objects in a real browser: sorted by hand and by keys, on a telephone, dark."""

import numpy as np
import pandas as pd
import pytest
from browser import TELEPHONE, WIDTHS, missing, shown, wide, written
from palpate.modulus import Modulus
from palpate.report import objects_page, objects_table
from plotly.offline import get_plotlyjs
from test_objects_page import view

pytestmark = pytest.mark.skipif(missing() is not None, reason=missing() or "")

NAMES = "return [...document.querySelectorAll('#estimates tbody th')].map((one) => one.textContent)"
SORTED = """
const heads = [...document.querySelectorAll("#estimates thead th")];
return heads.filter((one) => one.ariaSort).map((one) => [one.textContent, one.ariaSort]);
"""
BOX = "const box = document.querySelector('#estimates').parentElement;"
# Words of the table with their contrast to what lies behind them (WCAG 2.1).
FAINT = """
const light = (colour) => colour.match(/[\\d.]+/g).slice(0, 3).map(Number)
  .map((part) => part / 255 <= 0.03928 ? part / 255 / 12.92 : ((part / 255 + 0.055) / 1.055) ** 2.4)
  .reduce((sum, part, k) => sum + part * [0.2126, 0.7152, 0.0722][k], 0.05);
const behind = (one) => {
  const colour = one ? getComputedStyle(one).backgroundColor : "rgb(255, 255, 255)";
  return colour.endsWith(", 0)") ? behind(one.parentElement) : colour;
};
return [...document.querySelectorAll("#estimates *, h1, p, label, button, output")]
  .filter((one) => [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim()))
  .map((one) => {
    const look = getComputedStyle(one), front = one.closest("svg") ? look.fill : look.color;
    const ends = [light(front), light(behind(one))];
    return [one.textContent, Math.max(...ends) / Math.min(...ends)];
  }).filter(([, contrast]) => contrast < 4.5);
"""
DARK = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
MODULI_PA = {"toy_cow": 39e3, "ball": 210e3, "foam_10": 8e3, "foam_9": 12e3}


def recommended(name, young_pa):
    """Row as summary.csv has it; a ball of which force alone told E*."""
    row = {"object": name, "sensor": "cam", "capture": "all", "captures": 2}
    star = Modulus(1.1 * young_pa, young_pa, 1.2 * young_pa, "identified", "Pa")
    row |= star.cells("effective_reduced_modulus_pa") | {"effective_depth_m": 0.005}
    if name == "ball":
        return row
    young = Modulus.of_pascals(young_pa, 0.8 * young_pa, 1.3 * young_pa)
    nu = Modulus(0.3, 0.1, 0.5, "bounded", "1")
    return row | young.cells("youngs_modulus_pa") | nu.cells("poisson_ratio")


@pytest.fixture(scope="module")
def window(tmp_path_factory, root):
    table = pd.DataFrame([recommended(*one) for one in MODULI_PA.items()])
    text = objects_page.page(
        written(root, "objects.html"),
        behaviour=written(root, "objects.js"),
        plotly=get_plotlyjs(),
        views=[view()],
        tracker="study",
        estimates=objects_table.section(table.to_dict("records")),
    )
    yield from shown(tmp_path_factory.mktemp("sorting"), text)


@pytest.fixture
def press(window):
    """Press a head by a key, or click it."""
    wanted = (
        "document.querySelectorAll('#wanted').forEach((one) => one.id = '');"
        "[...document.querySelectorAll('#estimates button')]"
        ".find((one) => one.textContent === arguments[0]).id = 'wanted'"
    )

    def pressed(label, key=None):
        window.run(wanted, label)
        if key:
            window.press("#wanted", key)
        else:
            window.run("document.querySelector('#wanted').click()")
        return window.run(NAMES)

    return pressed


def test_a_click_sorts_up_and_the_next_down(window, press):
    assert press("E") == ["Foam 10", "Foam 9", "Toy cow", "Ball"]
    assert window.run(SORTED) == [["E", "ascending"]]
    # What has no E stays at the end.
    assert press("E") == ["Toy cow", "Foam 9", "Foam 10", "Ball"]
    assert window.run(SORTED) == [["E", "descending"]]
    assert press("Effective E*")[-1] == "Ball"
    assert window.run(SORTED) == [["Effective E*", "ascending"]]
    assert window.errors() == []


def test_keys_sort_and_words_go_by_the_alphabet(window, press):
    assert press("Object", "\ue007") == ["Ball", "Foam 9", "Foam 10", "Toy cow"]
    assert press("Object", " ") == ["Toy cow", "Foam 10", "Foam 9", "Ball"]
    assert press("Recorded with", "\ue007") == ["Toy cow", "Foam 10", "Foam 9", "Ball"]


def test_bars_stand_under_their_ticks(window):
    ends = window.run(
        "return [...document.querySelectorAll('#estimates svg')]"
        ".map((one) => one.getBoundingClientRect().left)"
    )
    assert len(ends) == 5
    np.testing.assert_allclose(ends, ends[0], atol=0.5)


@pytest.mark.parametrize("features", [{}, DARK], ids=["light", "dark"])
def test_words_stand_out(window, features):
    window.tell("Emulation.setEmulatedMedia", {"features": [], **features})
    dark = "return matchMedia('(prefers-color-scheme: dark)').matches"
    assert window.run(dark) == bool(features)
    assert window.run(FAINT) == []


def test_on_a_telephone_the_table_scrolls_in_its_own_box_and_on_a_desk_nothing_is_cut_off(window):
    ends = "(one) => one.getBoundingClientRect().right <= box.getBoundingClientRect().right"
    with wide(window, TELEPHONE):
        assert window.run(WIDTHS) == [390, 390]
        found = window.run(f"{BOX} return [box.scrollWidth > box.clientWidth, box.tabIndex]")
        assert found == [True, 0]
        svgs = "[...document.querySelectorAll('#estimates svg')]"
        assert window.run(f"{BOX} return {svgs}.every({ends})")
    with wide(window, {"width": 1400, "height": 900, "mobile": False}):
        assert window.run(f"{BOX} return box.scrollWidth <= box.clientWidth")
