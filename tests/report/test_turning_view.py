"""The dent on an object's page in a real browser: drawn, turned by hand and keys, in frames."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import trimesh
from browser import missing, shown, written
from palpate.estimate.direct.result import CaptureFit
from palpate.report.table_page import document
from palpate.report.turning_view import MOST_FRAMES, section, view_of

in_a_browser = pytest.mark.skipif(missing() is not None, reason=missing() or "")
VIEW = "return document.querySelector('.turning').view"
EYE = f"{VIEW}.eye"
TOLD = "return document.querySelector('output').textContent"
# The camera stands on the side of -y.
CAMERA_FROM_OBJECT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0.5], [0, 0, 0, 1]])
CANVAS, SLIDER = ".pair canvas", ".turning input"


def pressed(frames=5):
    """A ball whose top goes down, and samples that are seen to go in and computed to come out."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.04)
    depth = np.linspace(0, 0.01, frames)
    vertices = np.repeat(ball.vertices[None], frames, axis=0)
    top = ball.vertices[:, 2] > 0.03
    vertices[:, top, 2] -= depth[:, None]
    tracked = SimpleNamespace(
        vertices_m=vertices @ CAMERA_FROM_OBJECT[:3, :3].T + CAMERA_FROM_OBJECT[:3, 3],
        template_m=ball.vertices,
        faces=ball.faces,
        camera_from_object=CAMERA_FROM_OBJECT,
    )
    at = ball.vertices[(ball.vertices[:, 1] < -0.01) & ~top][::3]
    moved = -0.02 * np.outer(depth, np.ones(len(at)))
    moved[1:, 0] = np.nan
    fit = CaptureFit(
        time_s=np.arange(frames) / 10,
        tip_depth_m=depth,
        frames=np.arange(1, frames),
        force_n=np.linspace(0, 2, frames)[1:],
        depth_m=depth[1:],
        fitted_depth_m=depth[1:],
        depth_expected_std_m=np.full(frames - 1, 1e-4),
        moved_m=moved[1:],
        fitted_moved_m=-moved[1:],
        moved_expected_std_m=np.full(moved[1:].shape, 1e-5),
        cell_m=at,
        contact_m=np.array([0, 0, 0.04]),
        distance_m=np.ones(len(at)),
    )
    return tracked, fit, np.linspace(0, 2, frames)


def test_frames_are_spread_and_the_deepest_is_among_them():
    tracked, fit, force = pressed(frames=41)
    view = view_of(tracked, fit, force)
    assert len(view["frames"]) == MOST_FRAMES - 1 and view["deepest"] == MOST_FRAMES - 2
    assert view["frames"][-1] == "frame 41 of 41: 2.00 N, 10.0 mm"
    assert view["seen"][-1][0] is None and view["seen"][-1][1] == -0.2
    assert view["computed"][-1][1] == 0.2
    # The camera stands on the side of -y.
    assert view["from_rad"] == pytest.approx(0)


@pytest.fixture(scope="module")
def window(tmp_path_factory, root):
    behaviour, style = written(root, "own_page.js"), written(root, "own_page.css")
    text = document(
        section("cam 1", view_of(*pressed())), title="ball", style=style, behaviour=behaviour
    )
    yield from shown(tmp_path_factory.mktemp("turning"), text)


def seen(window, css=CANVAS):
    picture = np.frombuffer(window.picture(css), np.uint8)
    return cv2.imdecode(picture, cv2.IMREAD_COLOR).astype(int)


@in_a_browser
def test_measured_and_computed_motions_have_their_colours(window):
    for figure, end in ((1, (168, 94, 0)), (2, (0, 94, 213))):
        image = seen(window, f".pair figure:nth-child({figure}) canvas")
        near = np.abs(image - np.array(end)).max(axis=2) < 25
        assert near.mean() > 2e-3
    assert window.run(TOLD) == "frame 5 of 5: 2.00 N, 10.0 mm"
    assert window.errors() == []


@in_a_browser
def test_it_turns_by_hand_and_by_keys(window):
    before, eye = seen(window), window.run(EYE)
    window.drag(CANVAS, 60)
    assert window.run(EYE)["round"] == pytest.approx(eye["round"] - 0.5, abs=0.05)
    assert np.mean(np.any(before != seen(window), axis=2)) > 0.02
    window.press(CANVAS, "0")
    assert window.run(EYE) == eye
    np.testing.assert_array_equal(seen(window), before)
    window.press(CANVAS, "\ue012")
    assert window.run(EYE)["round"] == pytest.approx(eye["round"] - np.pi / 18)
    window.run("document.querySelector('[data-turn=back]').click()")
    assert window.run(EYE) == eye
    assert window.errors() == []


@in_a_browser
def test_frames_go_by_on_the_slider(window):
    before = seen(window)
    window.press(SLIDER, "\ue012\ue012\ue012")
    assert window.run(TOLD) == "frame 2 of 5: 0.50 N, 2.5 mm"
    assert np.mean(np.any(before != seen(window), axis=2)) > 5e-3
    window.press(SLIDER, "\ue014\ue014\ue014")
    np.testing.assert_array_equal(seen(window), before)
    assert window.errors() == []
