"""The table of all objects in a real browser: sorted by hand and by keys, on a telephone, dark."""

import shutil

import numpy as np
import pandas as pd
import pytest
import trimesh
from browser import browser, missing
from palpate.modulus import Modulus
from palpate.report import objects_page, objects_table
from palpate.surface.tracked import Tracked
from plotly.offline import get_plotlyjs

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


def view():
    """A ball that is pressed, for the page's other half."""
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.04)
    vertices = np.repeat(ball.vertices[None], 2, axis=0)
    vertices[1, vertices[0, :, 2] > 0.03, 2] -= 0.004
    tracked = Tracked(
        template_m=ball.vertices,
        faces=ball.faces,
        rest_m=ball.vertices,
        vertices_m=vertices,
        observed=np.ones(vertices.shape[:2], bool),
        camera_from_object=np.eye(4),
        residual_m=np.zeros(2),
        contact_point_m=np.array([0, 0, 0.04]),
        contact_frame=1,
    )
    capture = {"object": "ball", "sensor": "cam", "point": "01", "provenance": "recorded"}
    fit = {
        "range": {"first_frame": 0, "last_frame": 1},
        "samples": {"force_n": [0.0, 1.0], "depth_m": [0.0, 0.004]},
        "study": {"reduced_modulus_pa": 2.2e5},
        "recommended": {
            "reduced_modulus_pa": 2.1e5,
            "reduced_modulus_interval_pa": [2.0e5, 2.2e5],
            "doubts": [],
        },
    }
    return objects_page.view(objects_page.Shown(capture, tracked, fit, {}))


@pytest.fixture(scope="module")
def window(tmp_path_factory, root):
    folder = tmp_path_factory.mktemp("sorting")
    page, behaviour = (
        (root / f"workflow/report/objects.{end}").read_text() for end in ("html", "js")
    )
    table = pd.DataFrame([recommended(*one) for one in MODULI_PA.items()])
    text = objects_page.page(
        page,
        behaviour=behaviour,
        plotly=get_plotlyjs(),
        views=[view()],
        tracker="study",
        estimates=objects_table.section(table.to_dict("records")),
    )
    path = folder / "objects.html"
    path.write_text(text)
    with browser(folder / "profile") as opened:
        opened.open(path)
        opened.until("return document.body.dataset.drawn === 'yes'")
        yield opened
    shutil.rmtree(folder, ignore_errors=True)


def head(window, label):
    window.run(
        "[...document.querySelectorAll('#estimates button')]"
        ".find((one) => one.textContent === arguments[0]).id = 'wanted'",
        label,
    )


@pytest.fixture
def press(window):
    """Press a head by a key, or click it."""

    def pressed(label, key=None):
        window.run("document.querySelectorAll('#wanted').forEach((one) => one.id = '')")
        head(window, label)
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
    command = {"cmd": "Emulation.setEmulatedMedia", "params": {"features": [], **features}}
    window.ask("POST", "/goog/cdp/execute", command)
    dark = "return matchMedia('(prefers-color-scheme: dark)').matches"
    assert window.run(dark) == bool(features)
    assert window.run(FAINT) == []


def test_on_a_telephone_the_table_scrolls_in_its_own_box(window):
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    command = {"cmd": "Emulation.setDeviceMetricsOverride", "params": size}
    window.ask("POST", "/goog/cdp/execute", command)
    widths = window.run(
        "return [document.documentElement.scrollWidth, document.documentElement.clientWidth]"
    )
    assert widths == [390, 390]
    assert window.run(f"{BOX} return [box.scrollWidth > box.clientWidth, box.tabIndex]") == [
        True,
        0,
    ]
    shown = window.run(
        f"{BOX} return [...document.querySelectorAll('#estimates svg')].every("
        "(one) => one.getBoundingClientRect().right <= box.getBoundingClientRect().right)"
    )
    assert shown
    window.tell("Emulation.clearDeviceMetricsOverride", {})


def test_on_a_desk_nothing_is_cut_off(window):
    size = {"width": 1400, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    window.tell("Emulation.setDeviceMetricsOverride", size)
    assert window.run(f"{BOX} return box.scrollWidth <= box.clientWidth")
    window.tell("Emulation.clearDeviceMetricsOverride", {})
