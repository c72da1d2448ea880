"""An object's page in a real browser, with two sensors: reached by keys, narrow, and on paper."""

import base64
import re
import shutil

import cv2
import numpy as np
import pandas as pd
import pytest
from browser import browser, missing
from palpate.report.budget_bars import SOURCES
from palpate.report.held import Held
from palpate.report.other_methods import HERTZ
from palpate.report.own_page import CAPTIONS, own_page
from palpate.report.press_pictures import FOUND, MEASURED, Glimpse
from palpate.report.settings_words import checksums
from palpate.report.table_page import table
from palpate.report.turning_view import view_of
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
WIDTHS = "return [document.documentElement.scrollWidth, document.documentElement.clientWidth]"


def modulus(value, unit="Pa"):
    ends = {"low": 0.9 * value, "high": 1.1 * value}
    return {"value": value, "verdict": "identified", "unit": unit} | ends


MODULI = {
    "effective_reduced_modulus_pa": 45e3,
    "reduced_modulus_pa": 44e3,
    "youngs_modulus_pa": 38e3,
    "youngs_modulus_1s_pa": 35e3,
    "poisson_ratio": 0.38,
}
FURTHER = {"shear_modulus_pa": 14e3, "bulk_modulus_pa": 53e3}
FIT = {
    "samples": {"force_n": [0.0, 2.1, 2.0], "depth_m": [-0.001, 0.0046, 0.0045]},
    "radius_m": 0.006,
    "range": {"first_frame": 0, "last_frame": 1},
}
DEPTH = np.array([0.0, 0.0056, 0.0055])
DIRECT = {
    "frames": [9],
    "frames_beyond_lookup": [0],
    "nuisances": [{"offset_m": 0.001, "offset_std_m": 0.003}],
    "residuals": [{"cells": 80, "motion_scale": 1.26, "depth_scale": 1.1}],
    "converged": True,
}


def recommended(sensor):
    row = {"object": "toy", "sensor": sensor, "capture": "all", "point": "all"}
    row |= {"method": "direct_joint", "recommended": True, "captures": CAPTURES}
    row |= {"effective_depth_m": 0.0042, "force_law": 0.12, "force_law_std": 0.3}
    row |= {"provenance": "recorded", "motion_scale": 1.1}
    for name, value in MODULI.items():
        stem = name.removesuffix("_pa")
        unit = name[len(stem) :]
        row |= {name: value, f"{stem}_verdict": "identified"}
        row |= {f"{stem}_low{unit}": 0.9 * value, f"{stem}_high{unit}": 1.1 * value}
    return row


def joint():
    """direct.json with a budget of all sources, each with a bar."""
    parts = ("log_effective_reduced_modulus", "log_youngs_modulus", "poisson_ratio")
    budget = [
        {"source": name, "standard_uncertainty": 0.0005, "unit": "m", "origin": "configured"}
        | {f"contribution_{part}": 0.03 / (1 + at) for part in parts}
        for at, name in enumerate(SOURCES)
    ]
    found = {name: modulus(value) for name, value in (MODULI | FURTHER).items()}
    return found | {"effective": {"strain": 0.18, "depth_m": 0.0042}, "budget": budget}


def picture(width, height, end):
    """A drawing of noise would be as large as a photograph."""
    image = np.full((height, width, 3), 200, np.uint8)
    return cv2.imencode(end, cv2.circle(image, (width // 2, height // 2), 90, (90, 40, 10)))[1]


@pytest.fixture(scope="module")
def window(tmp_path_factory, root):
    folder = tmp_path_factory.mktemp("own_page")
    poses = pd.DataFrame({"time_s": [0.0, 1.0, 1.5], "detected": 1, "raw_tip_std_along_m": 5e-5})
    presses = [
        Held({"sensor": sensor, "capture": str(at)}, FIT, DIRECT, poses, DEPTH, np.arange(3))
        for sensor in SENSORS
        for at in range(CAPTURES)
    ]
    style, script = (
        (root / f"workflow/report/own_page.{end}").read_text() for end in ("css", "js")
    )
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
        style=style,
        views={f"{sensor} 1": view_of(*pressed()) for sensor in SENSORS},
        behaviour=script,
        overview="../objects.html",
    )
    page = folder / "report.html"
    page.write_text(text)
    with browser(folder / "profile") as opened:
        opened.open(page)
        opened.until("return document.body.dataset.drawn === 'yes'")
        yield opened
    shutil.rmtree(folder, ignore_errors=True)


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
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    window.tell("Emulation.setDeviceMetricsOverride", size)
    try:
        wide, there = window.run(WIDTHS)
        assert there == 390 and wide <= there
        boxes = "return [...document.querySelectorAll('.settings .wide')]"
        over = window.run(f"{boxes}.map((one) => one.scrollWidth - one.clientWidth)")
        assert over and max(over) <= 0
    finally:
        window.tell("Emulation.clearDeviceMetricsOverride", {})


def test_two_sensors_fit_four_sheets(window):
    sheets = window.ask("POST", "/print", {"page": {"width": 21.0, "height": 29.7}})
    count = len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(sheets)))
    assert 0 < count <= SHEETS
