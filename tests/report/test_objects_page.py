"""All objects in a table, and tracked surfaces as the viewer gets them."""

import base64

import numpy as np
import pytest
from palpate.modulus import Modulus
from palpate.report.objects_page import objects_page
from palpate.report.viewer import MOST_FRAMES, view
from palpate.surface.tracked import Tracked
from test_own_page import Words

CAPTURE = {"object": "foam_block", "sensor": "kinect", "capture": "08", "provenance": "simulated"}
FIT = {
    "range": {"first_frame": 1, "last_frame": 2},
    "samples": {"force_n": [0.0, 0.5, 1.25], "depth_m": [-0.01, 0.001, 0.0042]},
    "study": {"reduced_modulus_pa": 28667.2},
    "recommended": {
        "reduced_modulus_pa": 24021.3,
        "reduced_modulus_interval_pa": [22560.8, 25576.4],
        "doubts": ["a free side is near"],
    },
}


def tracked(depths_m=(0.0, 0.001, 0.004)):
    """A tetrahedron whose tip goes down, seen by a camera that looks along its -y."""
    template = np.array([[0, 0, 0], [0.06, 0, 0], [0, 0.03, 0], [0, 0, 0.02]], dtype=float)
    turn = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=float)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, [0.1, -0.2, 0.7]
    frames = np.repeat(template[None], len(depths_m), axis=0)
    frames[:, 3, 2] -= depths_m
    return Tracked(
        template_m=template,
        faces=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
        rest_m=template @ turn.T + pose[:3, 3],
        vertices_m=frames @ turn.T + pose[:3, 3],
        observed=np.ones(frames.shape[:2], dtype=bool),
        camera_from_object=pose,
        residual_m=np.zeros(len(frames)),
        contact_point_m=template[3],
        contact_frame=1,
    )


def read_back(found):
    steps = np.frombuffer(base64.b64decode(found["steps"]), dtype="<i2").reshape(-1, 4, 3)
    return found["middle_mm"] + found["step_mm"] * steps.astype(float)


def test_the_surface_comes_back_in_the_object_frame_in_millimetres():
    found = view(CAPTURE, tracked(), FIT)
    places = read_back(found)
    np.testing.assert_allclose(places[0], tracked().template_m * 1e3, atol=1e-3)
    np.testing.assert_allclose(places[2, 3], [0, 0, 16], atol=1e-3)
    faces = np.frombuffer(base64.b64decode(found["faces"]), dtype="<u4").reshape(-1, 3)
    np.testing.assert_array_equal(faces, tracked().faces)
    assert found["largest_mm"] == pytest.approx(4.0) and found["deepest_frame"] == 2
    # Displacement counts from the first frame; there is no depth before contact.
    assert view(CAPTURE, tracked((0.002, 0.002, 0.005)), FIT)["largest_mm"] == pytest.approx(3.0)
    assert found["frames"] == ["1 of 3: 0.00 N", "2 of 3: 0.50 N, 1.0 mm deep"] + [
        "3 of 3: 1.25 N, 4.2 mm deep"
    ]


def test_of_many_frames_some_are_shown_the_first_and_the_deepest_among_them():
    count = 101
    depths = np.linspace(0, 0.004, count)
    samples = {"force_n": depths * 300, "depth_m": depths}
    found = view(CAPTURE, tracked(depths), FIT | {"samples": samples, "range": {"last_frame": 51}})
    assert found["frames"][found["deepest_frame"]].startswith("52 of 101: ")
    assert len(found["frames"]) == MOST_FRAMES + 1 == len(read_back(found))
    np.testing.assert_allclose(read_back(found)[0], tracked().template_m * 1e3, atol=1e-3)


ROW = {"object": "toy_cow", "sensor": "kinect", "capture": "all", "captures": 3}
ROW |= {"provenance": "recorded"}


def row(young_pa, ratio=1.2, **changes):
    """Recommended row of summary.csv whose interval is this wide to either side."""
    young = Modulus.of_pascals(young_pa, young_pa / ratio, young_pa * ratio)
    nu = Modulus(0.38, 0.3, 0.45, "bounded", "1")
    return ROW | young.cells("youngs_modulus_pa") | nu.cells("poisson_ratio") | changes


def test_the_table_of_objects_has_values_verdicts_and_links_and_names_stay_text():
    found = objects_page([row(20e3), row(40e3, object="a<b"), ROW], pages=["toy_cow", "x&y"])
    assert 'href="toy_cow/report.html"' in found and 'href="x&amp;y/report.html"' in found
    assert found.count('class="dot') == 2 and 'id="scene"' not in found
    text = Words(found).text
    assert "20.0 kPa (16.7 to 24.0) identified" in text and "0.38 (0.30 to 0.45) bounded" in text
    assert "A<b" in text and "Kinect, 3 captures" in text and "Simulated" not in text
    assert "1 of 1" in Words(objects_page([row(20e3, provenance="simulated")])).text
