"""Pages of objects in a real browser: drawn, turned, sorted, by keys, narrow, dark, on paper."""

import base64
import re
from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
import pytest
import trimesh
from browser import TELEPHONE, WIDTHS, missing, shown, wide
from palpate.report.budget_bars import SOURCES
from palpate.report.held import Held
from palpate.report.objects_page import moduli_of, objects_page
from palpate.report.own_figures import MAPPED, OWN_FIGURES
from palpate.report.own_page import own_page
from palpate.report.point_maps import map_picture, point_maps
from palpate.report.press_pictures import FOUND, Glimpse
from palpate.report.settings_words import checksums
from palpate.report.viewer import map_view, view
from test_estimate_rows import estimate
from test_figures import capture_fit
from test_objects_page import CAPTURE, row, tracked
from test_objects_page import FIT as HERTZ
from test_own_page import ADVISED, DEPTH, DIRECT, FIT, JOINT, POSES, source

pytestmark = pytest.mark.skipif(missing() is not None, reason=missing() or "")
SENSORS, CAPTURES = ("kinect", "my_cam"), 3
TAB, ENTER, RIGHT, SHEETS, LARGEST_MB = "\ue004", "\ue007", "\ue014", 4, 8
FOCUSABLE = "a[href], button, input:not([type=radio]), summary, [tabindex='0']"
SEEN = f"""
return [...document.querySelectorAll("{FOCUSABLE}")].filter((one) => one.checkVisibility())
  .map((one, at) => {{ one.dataset.at = at; return at; }})
"""
FOCUS = """
const one = document.activeElement, style = getComputedStyle(one.closest("label") ?? one);
const box = one.getBoundingClientRect();
return [one.type === "radio" ? null : Number(one.dataset.at ?? -1),
  style.outlineStyle === "none" ? 0 : parseFloat(style.outlineWidth),
  box.bottom > 0 && box.top < innerHeight];
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
DARK = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
EYE = "return Object.values(scene._fullLayout.scene.camera.eye)"
TOLD = "return document.getElementById('told').textContent"
NAMES = "return [...document.querySelectorAll('#estimates tbody th')].map((one) => one.textContent)"
CLICK = """
[...document.querySelectorAll('#estimates button')]
  .find((one) => one.textContent === arguments[0]).click()
"""


def ball():
    """A ball whose top goes down, and samples that are seen to go in and computed to come out."""
    mesh, depth_m = trimesh.creation.icosphere(subdivisions=3, radius=0.04), [0.0, 0.01, 0.005]
    pose = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0.5], [0, 0, 0, 1]])
    vertices, top = np.repeat(mesh.vertices[None], 3, axis=0), mesh.vertices[:, 2] > 0.03
    vertices[:, top, 2] -= np.array(depth_m)[:, None]
    surface = replace(
        tracked(),
        template_m=mesh.vertices,
        faces=mesh.faces,
        vertices_m=vertices @ pose[:3, :3].T + pose[:3, 3],
        camera_from_object=pose,
    )
    at = mesh.vertices[(mesh.vertices[:, 1] < -0.01) & ~top][::3]
    moved = np.full((3, len(at)), -2e-4)
    moved[:, 0] = np.nan
    seen = {"cell_m": at, "moved_m": moved, "fitted_moved_m": -moved}
    samples = {"force_n": [0.0, 2.0, 1.0], "depth_m": depth_m}
    fit = {"samples": samples, "range": {"last_frame": 1}}
    return surface, fit, replace(capture_fit(), **seen)


def picture(width, height, end):
    """A drawing: one of noise would be as large as a photograph."""
    image = np.full((height, width, 3), 200, np.uint8)
    return cv2.imencode(end, cv2.circle(image, (width // 2, height // 2), 90, (90, 40, 10)))[1]


def maps():
    """Three points of the ball, one of them stiffer by far."""
    places = {name: 0.04 * np.array(axis) for name, axis in zip("123", -np.eye(3), strict=True)}
    captures = [CAPTURE | {"sensor": SENSORS[0], "point": name} for name in places]
    singles = [estimate(E, 0.3, 500.0) for E in (20e3, 60e3, 20e3)]
    return point_maps(captures, singles, [CAPTURE | {"sensor": SENSORS[0]}], places)


@pytest.fixture(scope="module")
def own_html():
    """A page of two sensors, with all sources of a budget."""
    budget = [source(name, *[0.03 / (1 + k)] * 3) for k, name in enumerate(SOURCES)]
    jpeg = picture(640, 520, ".jpg").tobytes()
    return own_page(
        "toy",
        pd.DataFrame([ADVISED | {"sensor": sensor, "captures": CAPTURES} for sensor in SENSORS]),
        [
            Held({"sensor": sensor, "capture": str(at)}, FIT, DIRECT, POSES, DEPTH, np.arange(3))
            for sensor in SENSORS
            for at in range(CAPTURES)
        ],
        pictures={one.name: picture(2160, 1300, ".png").tobytes() for one in OWN_FIGURES}
        | {MAPPED: map_picture(maps(), ball()[0].template_m, ball()[0].faces, {"simulated"})},
        glimpses=[Glimpse(jpeg, f"my_cam 1, frame {k} of 40, 1.20 N", FOUND) for k in range(12)],
        joints={sensor: JOINT | {"budget": budget} for sensor in SENSORS},
        settings=[{"setting": "probe", "value": "pen: sphere of radius 4 mm"}],
        checksums=checksums({f"file {k}": __file__ for k in range(8)}),
        files={"object": "a: 1"},
        views=[view(CAPTURE | {"sensor": sensor}, *ball()) for sensor in SENSORS]
        + [map_view(one, ball()[0]) for one in maps()],
        maps=maps(),
    )


@pytest.fixture(scope="module")
def own(tmp_path_factory, own_html):
    yield from shown(tmp_path_factory.mktemp("own_page"), own_html)


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    moduli_pa = {"toy_cow": 39e3, "ball": 210e3, "foam_10": 8e3, "foam_9": 12e3}
    rows = [row(E, object=name) for name, E in moduli_pa.items()]
    rows[1] |= {"youngs_modulus_pa": None}
    beside = {"views": [view(CAPTURE, tracked(), HERTZ)], "moduli": [moduli_of(HERTZ, {})]}
    text = objects_page(rows, pages=["toy_cow"], **beside)
    yield from shown(tmp_path_factory.mktemp("objects"), text)


def seen(window):
    """Colours of the scene, once two looks agree."""
    before = None
    for _ in range(20):
        now = cv2.imdecode(np.frombuffer(window.picture("#scene"), np.uint8), cv2.IMREAD_COLOR)
        if before is not None and np.array_equal(before, now):
            break
        before = now
    return now.astype(int)


def share_of(image, colour):
    return (np.abs(image - np.array(colour)).max(axis=2) < 25).mean()


def test_all_that_acts_is_reached_by_tab_and_seen_to_be(own):
    expected, reached = own.run(SEEN), []
    for _ in range(len(expected) + 2):
        own.type(TAB)
        at, outline_px, on_screen = own.run(FOCUS)
        assert outline_px >= 2 and on_screen
        reached += [] if at is None else [at]
    assert reached == expected


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
    assert own.run(TOLD) == "2 of 3: 2.00 N, 3.0 mm deep, maximum depth"
    own.press("#frame", RIGHT)
    assert own.run(TOLD) == "3 of 3: 1.00 N, 2.0 mm deep"
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


def test_an_own_page_fits_a_telephone_four_sheets_and_eight_megabytes(own, own_html):
    with wide(own, TELEPHONE):
        assert own.run(WIDTHS) == [390, 390]
        boxes = "[...document.querySelectorAll('.wide')]"
        over = own.run(f"return {boxes}.map((one) => one.scrollWidth - one.clientWidth)")
        assert over and max(over) <= 0
    sheets = own.ask("POST", "/print", {"page": {"width": 21.0, "height": 29.7}})
    assert 0 < len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(sheets))) <= SHEETS
    assert len(own_html) < LARGEST_MB * 1e6


@pytest.mark.parametrize("features", [{}, DARK], ids=["light", "dark"])
def test_words_stand_out(own, objects, features):
    for window in (own, objects):
        window.tell("Emulation.setEmulatedMedia", {"features": [], **features})
        assert window.run(FAINT) == []


def test_objects_are_sorted_by_number_by_name_and_by_keys(objects):
    objects.run(CLICK, "E")
    assert objects.run(NAMES) == ["Foam 10", "Foam 9", "Toy cow", "Ball"]
    # What has no E stays at the end.
    objects.run(CLICK, "E")
    assert objects.run(NAMES) == ["Toy cow", "Foam 9", "Foam 10", "Ball"]
    assert objects.run("return document.querySelector('[aria-sort]').ariaSort") == "descending"
    objects.press("#estimates button", ENTER)
    assert objects.run(NAMES) == ["Ball", "Foam 9", "Foam 10", "Toy cow"]
    assert objects.errors() == []


def test_on_a_telephone_the_table_of_objects_shows_all_numbers(objects):
    with wide(objects, TELEPHONE):
        assert objects.run(WIDTHS) == [390, 390]
        ends = objects.run(
            "return [...document.querySelectorAll('#estimates td > span')]"
            ".map((one) => one.getBoundingClientRect().right)"
        )
        assert len(ends) == 4 * 2 - 1 and max(ends) <= 390
