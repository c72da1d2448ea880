"""The page of objects: their table on one axis, tracked surfaces, moduli, and bad input."""

import base64
import re

import numpy as np
import pytest
from palpate.modulus import Modulus
from palpate.report import objects_page
from palpate.report.objects_table import section, ticks
from palpate.surface.tracked import Tracked

TEMPLATE = (
    "<style>@@style@@</style>@@estimates@@"
    "<script>@@plotly@@</script><script>@@data@@</script><script>@@behaviour@@</script>"
)
CAPTURE = {
    "object": "foam_block",
    "sensor": "kinect",
    "capture": "08",
    "point": "08",
    "provenance": "simulated",
}
FIT = {
    "range": {"first_frame": 1, "last_frame": 2},
    "samples": {"force_n": [0.0, 0.5, 1.25], "depth_m": [-0.01, 0.001, 0.0042]},
    "study": {"reduced_modulus_pa": 28667.2},
    "recommended": {
        "reduced_modulus_pa": 24021.3,
        "reduced_modulus_interval_pa": [22560.8, 25576.4],
        "doubts": [],
    },
}
MINIMUM = {
    "youngs_modulus_pa": 20000.0,
    "poisson_ratio": 0.251,
    "reduced_modulus_pa": 21347.0,
    "profile": {"verdict": "not identified"},
    "least_squares": {"length": {"unknown": "gaps agree over the surface"}},
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


def view(surface=None, fit=FIT):
    shown = objects_page.Shown(CAPTURE, surface or tracked(), fit, {"displacement": MINIMUM})
    return objects_page.view(shown)


def read_back(view):
    steps = np.frombuffer(base64.b64decode(view["steps"]), dtype="<i2").reshape(-1, 4, 3)
    return view["middle_mm"] + view["step_mm"] * steps.astype(float)


def test_the_surface_comes_back_in_the_object_frame_in_millimetres():
    places = read_back(view())
    np.testing.assert_allclose(places[0], tracked().template_m * 1e3, atol=1e-3)
    np.testing.assert_allclose(places[2, 3], [0, 0, 16], atol=1e-3)
    found = view()
    faces = np.frombuffer(base64.b64decode(found["faces"]), dtype="<u4").reshape(-1, 3)
    np.testing.assert_array_equal(faces, tracked().faces)
    assert found["largest_mm"] == pytest.approx(4.0)
    assert found["deepest_frame"] == 2
    # Displacement counts from the first frame.
    assert view(tracked((0.002, 0.002, 0.005)))["largest_mm"] == pytest.approx(3.0)
    # No depth before contact.
    assert view()["frames"] == ["0.00 N", "0.50 N, 1.0 mm deep", "1.25 N, 4.2 mm deep"]


def test_moduli_carry_interval_and_verdict():
    rows = view()["moduli"]
    assert [row["reduced"] for row in rows] == ["28.7 kPa", "24.0 kPa (22.6 to 25.6)", "21.3 kPa"]
    assert rows[2]["E"] == "20.0 kPa"
    assert rows[2]["nu"] == "0.25"
    assert rows[2]["verdict"] == "not identified (gaps agree over the surface)"
    row = objects_page.moduli(FIT, {"displacement": MINIMUM | {"at_bound": True}})[2]
    assert row["E"] == "20.0 kPa (at a bound)" and row["nu"] == "0.25 (at a bound)"
    assert row["reduced"] == "21.3 kPa (at a bound)"


def test_the_page_is_the_same_and_no_part_ends_its_script():
    parts = {"behaviour": "f()", "plotly": "'</script>'", "tracker": "</script>"}
    pages = {objects_page.page(TEMPLATE, views=[view()], **parts) for _ in range(2)}
    assert len(pages) == 1
    assert pages.pop().count("</script>") == 3


def test_a_doubtful_model_says_why():
    line = "a free side 6 mm from the press takes some 22 % of the force: trust the direct estimate"
    doubtful = FIT | {"recommended": FIT["recommended"] | {"doubts": [line]}}
    assert objects_page.moduli(doubtful, {})[1]["verdict"] == line
    assert objects_page.moduli(FIT, {})[1]["verdict"] == ""


def test_input_that_does_not_fit():
    with pytest.raises(ValueError, match="template: expected @@data@@ once, found it 0 times"):
        objects_page.page(
            TEMPLATE.replace("@@data@@", ""), behaviour="", plotly="", views=[], tracker="study"
        )
    samples = {"force_n": [0.0], "depth_m": [0.0]}
    with pytest.raises(ValueError, match="samples: expected 3, one for each frame, found 1"):
        view(fit=FIT | {"samples": samples})
    with pytest.raises(ValueError, match="vertices_m: expected finite places"):
        view(tracked((0.0, np.nan, 0.004)))


def test_what_is_recommended_stands_first():
    row = {"sensor": "kinect", "capture": "all", "captures": 3}
    row |= {"youngs_modulus_pa": 38120.0, "youngs_modulus_low_pa": 35000.0}
    row |= {"youngs_modulus_high_pa": 41049.0, "youngs_modulus_verdict": "identified"}
    row |= {"poisson_ratio": 0.384, "poisson_ratio_verdict": "bounded"}
    shown = objects_page.Shown(CAPTURE, tracked(), FIT, {"displacement": MINIMUM}, row)
    first, *others = objects_page.view(shown)["moduli"]
    assert first["method"] == "Recommended, by Kinect and 3 captures"
    assert first["E"] == "38.1 kPa (35.0 to 41.0)" and "only limits" in first["verdict"]
    assert others == view()["moduli"]


ROW = {"object": "toy_cow", "sensor": "kinect", "capture": "all", "captures": 3}


def row(young_pa, ratio=1.2, **changes):
    """Recommended row of summary.csv whose interval is this wide to either side."""
    young = Modulus.of_pascals(young_pa, young_pa / ratio, young_pa * ratio)
    nu = Modulus(0.38, 0.3, 0.45, "identified", "1")
    return ROW | young.cells("youngs_modulus_pa") | nu.cells("poisson_ratio") | changes


def places(text):
    """Middles of the dots and ends of the intervals [px]."""
    dots = [float(one) for one in re.findall(r'cx="([\d.]+)"', text)]
    ends = re.findall(r'class="interval" d="M([\d.]+) [\d.]+H([\d.]+)', text)
    return np.array(dots), np.array(ends, float)


def test_one_estimate_is_no_table_and_names_stay_text():
    assert section([]) == section([row(20e3)]) == ""
    assert "A&lt;b" in section([row(20e3), row(40e3, object="a<b")])
    assert 'href="a&amp;b/report.html">A&amp;b</a>' in section([], ["a&b"])


def test_bars_share_a_logarithmic_axis():
    dots, ends = places(section([row(1e3), row(10e3), row(100e3)]))
    assert dots[1] - dots[0] == pytest.approx(dots[2] - dots[1], abs=0.1)
    halves = np.log(1.2) / np.log(10) * (dots[1] - dots[0])
    np.testing.assert_allclose(ends, np.add.outer(dots, [-halves, halves]), atol=0.2)


def test_an_object_without_e_has_no_bar_and_one_without_interval_none_about_its_dot():
    bare = {"youngs_modulus_low_pa": np.nan, "youngs_modulus_high_pa": np.nan}
    text = section([ROW, row(20e3) | bare])
    dots, ends = places(text)
    assert len(dots) == 1 and len(ends) == 0
    assert "<svg" not in section([ROW, ROW])


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((30e3, 50e3), [20e3, 50e3]),
        ((20e3, 20e3), [20e3, 50e3]),
        ((6e3, 50.6e3), [5e3, 10e3, 20e3, 50e3, 100e3]),
        ((1.5e3, 2e6), [1e3, 1e4, 1e5, 1e6, 1e7]),
        ((3.0, 2e8), [1.0, 1e3, 1e6, 1e9]),
    ],
)
def test_the_axis_holds_all_between_round_ends(values, expected):
    found = ticks([Modulus(value, None, None, "not judged", "Pa") for value in values])
    np.testing.assert_allclose(found, expected)
    assert ticks([Modulus(30e3, 9e3, 60e3, "bounded", "Pa")]) == [5e3, 10e3, 20e3, 50e3, 100e3]
