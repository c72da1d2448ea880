"""Pages of objects in a real browser: drawn, turned, sorted, by keys, narrow, dark, on paper."""

import base64
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from browser import TELEPHONE, WIDTHS, missing, shown, wide
from made_up import CAPTURE, FIT, GROUP, HERTZ, JOINT, SURFACE, TOP, estimate, held, source
from palpate.report.budget_bars import SOURCES
from palpate.report.estimate_rows import direct_rows, summary
from palpate.report.objects_page import moduli_of, objects_page
from palpate.report.own_figures import MAPPED, OWN_FIGURES
from palpate.report.own_page import own_page
from palpate.report.point_maps import map_picture, point_maps
from palpate.report.press_pictures import FOUND, Glimpse
from palpate.report.settings_words import checksums
from palpate.report.viewer import map_view, view

pytestmark = pytest.mark.skipif(missing() is not None, reason=missing() or "")
SENSORS, DESK = ("kinect", "my_cam"), {"width": 1400, "height": 900, "mobile": False}
TAB, ENTER, RIGHT, SHEETS, LARGEST_MB = "\ue004", "\ue007", "\ue014", 4, 8
UNREACHED = """
return [...document.querySelectorAll(
  "a[href], button, input:not([type=radio]), summary, [tabindex='0']"
)].filter((one) => one.checkVisibility() && !("reached" in one.dataset)).length
"""
FOCUS = """
const one = document.activeElement, style = getComputedStyle(one.closest("label") ?? one);
const box = one.getBoundingClientRect();
one.dataset.reached = "";
return box.bottom > 0 && box.top < innerHeight && style.outlineStyle !== "none"
  && parseFloat(style.outlineWidth) >= 2;
"""
# Words with their contrast to what lies behind them (WCAG 2.1).
FAINT = """
const light = (colour) => colour.match(/[\\d.]+/g).slice(0, 3).map(Number)
  .map((part) => part / 255 <= 0.03928 ? part / 255 / 12.92 : ((part / 255 + 0.055) / 1.055) ** 2.4)
  .reduce((sum, part, k) => sum + part * [0.2126, 0.7152, 0.0722][k], 0.05);
const behind = (one) => {
  const colour = one ? getComputedStyle(one).backgroundColor : "rgb(255, 255, 255)";
  return colour.endsWith(", 0)") ? behind(one.parentElement) : colour;
};
return [...document.querySelectorAll("body *:not(script, #scene *)")]
  .filter((one) => [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim()))
  .map((one) => {
    const look = getComputedStyle(one), front = one.closest("svg") ? look.fill : look.color;
    const ends = [light(front), light(behind(one))];
    return [one.textContent, Math.max(...ends) / Math.min(...ends)];
  }).filter(([, contrast]) => contrast < 4.5);
"""
OVER = "return [...document.querySelectorAll('.wide')].map((e) => e.scrollWidth - e.clientWidth)"
DARK = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
EYE = "return Object.values(scene._fullLayout.scene.camera.eye)"
TOLD = "return document.getElementById('told').textContent"
NAMES = "return [...document.querySelectorAll('#estimates tbody th')].map((one) => one.textContent)"
SORT = "#estimates thead th:nth-child({}) button"


@pytest.fixture(scope="module")
def own_html():
    """A page of two sensors with all sources of a budget, and a point stiffer than two others."""
    budget = [source(s, *[0.03 / (1 + k)] * 3, std=5e-4, unit="m") for k, s in enumerate(SOURCES)]
    joint = estimate(38e3, 0.38, 3e3, budget=budget)
    # A drawing: one of noise would be as large as a photograph.
    image = cv2.circle(np.full((1300, 2160, 3), 200, np.uint8), (300, 250), 90, (90, 40, 10))
    png, jpeg = cv2.imencode(".png", image)[1], cv2.imencode(".jpg", image[:520, :640])[1]
    groups = [GROUP | {"sensor": name, "provenance": "recorded"} for name in SENSORS]
    places = {name: 0.04 * np.array(axis) for name, axis in zip("123", -np.eye(3), strict=True)}
    singles = [estimate(E, 0.3, 500.0) for E in (20e3, 60e3, 20e3)]
    maps = point_maps([CAPTURE | {"point": name} for name in places], singles, [GROUP], places)
    pictures = {one.name: png.tobytes() for one in OWN_FIGURES}
    pictures[MAPPED] = map_picture(maps, SURFACE.template_m, SURFACE.faces, {"simulated"})
    # Samples that are seen to go in and computed to come out.
    at = SURFACE.template_m[(SURFACE.template_m[:, 1] < -0.01) & ~TOP][::3]
    moved = np.full((len(FIT.frames), len(at)), -2e-4)
    moved[:, 0] = np.nan
    fit = replace(FIT, cell_m=at, moved_m=moved, fitted_moved_m=-moved)
    views = [view(CAPTURE | {"sensor": name}, SURFACE, HERTZ, fit) for name in SENSORS]
    return own_page(
        "toy",
        summary(direct_rows([], [], groups, [joint] * 2)),
        [held(joint, sensor=name, capture=at) for name in SENSORS for at in "123"],
        pictures=pictures,
        glimpses=[Glimpse(jpeg.tobytes(), f"frame {k}, 1.20 N", FOUND) for k in range(12)],
        joints=dict.fromkeys(SENSORS, joint),
        settings=[{"setting": "probe", "value": "pen: sphere of radius 4 mm"}],
        checksums=checksums({f"file {k}": __file__ for k in range(8)}),
        files={"object": "a: 1"},
        views=[*views, *(map_view(one, SURFACE) for one in maps)],
        maps=maps,
    )


@pytest.fixture(scope="module")
def own(tmp_path_factory, own_html):
    yield from shown(tmp_path_factory.mktemp("own_page"), own_html)


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    row, moduli_pa = next(direct_rows([], [], [GROUP], [JOINT])), (None, 8e3, 12e3, 39e3)
    named = zip(("ball", "foam_10", "foam_9", "toy_cow"), moduli_pa, strict=True)
    rows = [row | {"object": name, "youngs_modulus_pa": E} for name, E in named]
    beside = {"views": [view(CAPTURE, SURFACE, HERTZ)], "moduli": [moduli_of(HERTZ, {})]}
    text = objects_page(rows, pages=["toy_cow"], **beside)
    yield from shown(tmp_path_factory.mktemp("objects"), text)


def seen(window):
    """Colours of the scene, once two looks agree."""
    looks = [b"", window.picture("#scene")]
    while looks[-1] != looks[-2] and len(looks) < 20:
        looks.append(window.picture("#scene"))
    return cv2.imdecode(np.frombuffer(looks[-1], np.uint8), cv2.IMREAD_COLOR).astype(int)


def share_of(image, colour):
    return (np.abs(image - np.array(colour)).max(axis=2) < 25).mean()


def test_all_that_acts_is_reached_by_tab_and_seen_to_be(own):
    """With a stop at each of two groups of radio buttons."""
    for _ in range(own.run(UNREACHED) + 2):
        own.type(TAB)
        assert own.run(FOCUS)
    assert own.run(UNREACHED) == 0


def test_measured_and_computed_displacements_have_their_colours_and_turn_by_keys(own):
    inward, outward = (168, 94, 0), (0, 94, 213)
    measured = seen(own)
    assert share_of(measured, inward) > 1e-3 > share_of(measured, outward)
    own.run("document.querySelector('[value=computed]').click()")
    assert share_of(seen(own), outward) > 1e-3
    eye = own.run(EYE)
    own.press("#scene", RIGHT)
    turned = np.degrees(np.arctan2(*own.run(EYE)[1::-1]) - np.arctan2(*eye[1::-1]))
    assert turned == pytest.approx(10)
    own.press("#scene", "0")
    assert own.run(EYE) == pytest.approx(eye)
    # Depths are the estimate's, not those recorded.
    assert own.run(TOLD) == "16 of 26: 2.00 N, 4.0 mm deep, maximum depth"
    own.press("#frame", RIGHT)
    assert own.run(TOLD) == "17 of 26: 2.00 N, 4.0 mm deep"
    assert own.errors() == []


def test_a_map_has_the_colours_of_stiffness_and_no_frames(own):
    stiff, soft = (60, 200, 240), (110, 50, 15)
    own.run("document.querySelector('[name=capture][value=\"2\"]').click()")
    found = seen(own)
    assert min(share_of(found, stiff), share_of(found, soft)) > 1e-3
    assert "3 points: the points differ" in own.run(TOLD)
    hidden = "return document.querySelector('#frame').checkVisibility()"
    assert not own.run(hidden)
    own.run("document.querySelector('[name=capture]').click()")
    assert own.run(hidden) and own.errors() == []


@pytest.mark.parametrize("size", [TELEPHONE, DESK], ids=["telephone", "desk"])
def test_pages_fit_the_window(own, objects, size):
    for window in (own, objects):
        with wide(window, size):
            width, room = window.run(WIDTHS)
            assert width <= room <= size["width"]
            assert size is DESK or max(window.run(OVER)) <= 0


def test_an_own_page_takes_four_sheets_and_eight_megabytes(own, own_html):
    sheets = own.ask("POST", "/print", {"page": {"width": 21.0, "height": 29.7}})
    assert 0 < len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(sheets))) <= SHEETS
    assert len(own_html) < LARGEST_MB * 1e6


@pytest.mark.parametrize("features", [{}, DARK], ids=["light", "dark"])
def test_words_stand_out(own, objects, features):
    for window in (own, objects):
        window.tell("Emulation.setEmulatedMedia", {"features": [], **features})
        assert window.run(FAINT) == []


def test_objects_are_sorted_by_number_by_name_and_by_keys(objects):
    objects.press(SORT.format(3), ENTER)
    assert objects.run(NAMES) == ["Foam 10", "Foam 9", "Toy cow", "Ball"]
    # What has no E stays at the end.
    objects.press(SORT.format(3), ENTER)
    assert objects.run(NAMES) == ["Toy cow", "Foam 9", "Foam 10", "Ball"]
    assert objects.run("return document.querySelector('[aria-sort]').ariaSort") == "descending"
    objects.press(SORT.format(1), ENTER)
    assert objects.run(NAMES) == ["Ball", "Foam 9", "Foam 10", "Toy cow"]
    assert objects.errors() == []
