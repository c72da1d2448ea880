"""An object's page in a real browser, with two sensors: reached by keys, narrow, and on paper."""

import base64
import re

import cv2
import numpy as np
import pandas as pd
import pytest
from browser import TELEPHONE, WIDTHS, missing, shown, wide, written
from palpate.report.budget_bars import SOURCES
from palpate.report.held import Held
from palpate.report.other_methods import HERTZ
from palpate.report.own_page import CAPTIONS, own_page
from palpate.report.press_pictures import FOUND, MEASURED, Glimpse
from palpate.report.settings_words import checksums
from palpate.report.table_page import table
from palpate.report.turning_view import view_of
from test_own_page import ADVISED, DEPTH, DIRECT, FIT, JOINT, POSES, source
from test_turning_view import pressed

pytestmark = pytest.mark.skipif(missing() is not None, reason=missing() or "")
SENSORS, CAPTURES = ("kinect", "my_cam"), 3
# Figures' sizes with two sensors [px at 100 to the inch]: width and height.
SIZES = {"moduli": (720, 254), "fit": (720, 600), "known": (720, 520), "surface": (720, 410)}
SIZES |= {HERTZ: (720, 480)}
TAB, SHEETS = "\ue004", 4
FOCUSABLE = "a[href], button, input, summary, canvas, [tabindex='0']"
SEEN = f"""
return [...document.querySelectorAll("{FOCUSABLE}")].filter((one) => one.checkVisibility())
  .map((one, at) => {{ one.dataset.at = at; return at; }})
"""
FOCUS = """
const one = document.activeElement, style = getComputedStyle(one);
const box = one.getBoundingClientRect();
return [one.dataset.at === undefined ? -1 : Number(one.dataset.at),
  style.outlineStyle === "none" ? 0 : parseFloat(style.outlineWidth),
  box.bottom > 0 && box.top < innerHeight];
"""


def recommended(sensor):
    return ADVISED | {"sensor": sensor, "captures": CAPTURES}


def joint():
    """direct.json with a budget of all sources, each with a bar."""
    return JOINT | {
        "budget": [source(name, *[0.03 / (1 + k)] * 4) for k, name in enumerate(SOURCES)]
    }


def picture(width, height, end):
    """A drawing of noise would be as large as a photograph."""
    image = np.full((height, width, 3), 200, np.uint8)
    return cv2.imencode(end, cv2.circle(image, (width // 2, height // 2), 90, (90, 40, 10)))[1]


@pytest.fixture(scope="module")
def window(tmp_path_factory, root):
    presses = [
        Held({"sensor": sensor, "capture": str(at)}, FIT, DIRECT, POSES, DEPTH, np.arange(3))
        for sensor in SENSORS
        for at in range(CAPTURES)
    ]
    jpeg = picture(640, 520, ".jpg").tobytes()
    text = own_page(
        "toy",
        pd.DataFrame([recommended(sensor) for sensor in SENSORS]),
        presses,
        pictures={
            name: picture(*(3 * side for side in SIZES[name]), ".png").tobytes()
            for name in (*CAPTIONS, HERTZ)
        },
        glimpses=[
            Glimpse(jpeg, f"my_cam 1, frame {k} of 40, 1.20 N", (FOUND, MEASURED)[k % 2])
            for k in range(12)
        ],
        joints={sensor: joint() for sensor in SENSORS},
        settings="\n".join(table(checksums({f"file {k}": __file__ for k in range(8)}))),
        files="```yaml\na: 1\n```",
        style=written(root, "own_page.css"),
        views={f"{sensor} 1": view_of(*pressed()) for sensor in SENSORS},
        behaviour=written(root, "own_page.js"),
        overview="../objects.html",
    )
    yield from shown(tmp_path_factory.mktemp("own_page"), text)


def test_all_that_acts_is_reached_by_tab_and_seen_to_be(window):
    expected = window.run(SEEN)
    kinds = window.run("return [...document.querySelectorAll('[data-at]')].map((x) => x.tagName)")
    assert {"A", "CANVAS", "INPUT", "BUTTON", "SUMMARY"} <= set(kinds)
    reached = []
    for _ in expected:
        window.type(TAB)
        at, outline_px, on_screen = window.run(FOCUS)
        assert outline_px >= 2 and on_screen, kinds[at]
        reached.append(at)
    assert reached == expected


def test_nothing_is_wider_than_a_narrow_telephone(window):
    with wide(window, TELEPHONE):
        width, there = window.run(WIDTHS)
        assert there == 390 and width <= there
        boxes = "return [...document.querySelectorAll('.settings .wide')]"
        over = window.run(f"{boxes}.map((one) => one.scrollWidth - one.clientWidth)")
        assert over and max(over) <= 0


def test_two_sensors_fit_four_sheets(window):
    sheets = window.ask("POST", "/print", {"page": {"width": 21.0, "height": 29.7}})
    count = len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(sheets)))
    assert 0 < count <= SHEETS
