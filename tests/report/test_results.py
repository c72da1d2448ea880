"""Results as people get them: rows of a summary, tables, files, a figure, and pages of objects."""

import hashlib
import re
from base64 import b64decode
from dataclasses import replace
from html import unescape

import numpy as np
import pandas as pd
import pytest
from made_up import CAPTURE, FIT, GROUP, HERTZ, JOINT, MOTION, POSES, SURFACE, TOP, estimate, held
from palpate.estimate.direct.result import load_fitted, save_fitted
from palpate.modulus import Modulus
from palpate.report import data_package, data_tables, pages
from palpate.report.estimate_rows import STAR, direct_rows, hertz_rows, row, summary
from palpate.report.fitted_figures import known
from palpate.report.objects_page import objects_page
from palpate.report.own_page import own_page
from palpate.report.point_maps import point_maps
from palpate.report.settings_words import checksums
from palpate.report.viewer import MOST_FRAMES, view

ADVISED = [*direct_rows([], [], [GROUP | {"provenance": "recorded"}], [JOINT])]
ONE = (held(JOINT),)


def test_a_hertz_fit_with_doubts_is_not_judged():
    fits = HERTZ, HERTZ | {"recommended": HERTZ["study"] | {"warnings": ["no layer"]}}
    found = summary(hertz_rows([CAPTURE] * 2, fits))
    unjudged = (found["reduced_modulus_verdict"] == "not judged").tolist()
    assert unjudged == [True, True, False, False, False, True]
    assert found["youngs_modulus_pa"].isna().all() and not found["recommended"].any()


@pytest.mark.parametrize(("E", "verdict"), [(18650.0, "bounded"), (18700.0, "identified")])
def test_sensors_that_exclude_each_other_identify_nothing(E, verdict):
    """Intervals of 1 kPa to each side; the capture alone is of the one sensor."""
    joints = [estimate(one, 0.3, 1000.0) for one in (20500.0, E)]
    groups = [GROUP, GROUP | {"sensor": "bumblebee"}]
    rows = pd.DataFrame(direct_rows([CAPTURE], [joints[0]], groups, joints))
    for name in ("youngs_modulus", "poisson_ratio"):
        assert rows[f"{name}_verdict"].tolist() == ["identified", verdict, verdict]
    assert rows.filter(["warnings"]).notna().to_numpy().sum() == 3 * (verdict == "bounded")
    # Other objects are not compared.
    rows = pd.DataFrame(direct_rows([], [], [GROUP, groups[1] | {"object": "rubber"}], joints))
    assert "warnings" not in rows and (rows["youngs_modulus_verdict"] == "identified").all()


def test_whether_points_differ_takes_three_of_them():
    captures = [CAPTURE | {"capture": name, "point": name} for name in "123"]
    places_m = dict(zip("123", np.diag([0.01, 0.02, 0.03]), strict=True))
    singles = [estimate(one, 0.3, 1000.0) for one in (20e3, 20.2e3, 30e3)]
    rows = pd.DataFrame(direct_rows(captures, singles, [GROUP], [JOINT]))
    assert rows["points"].isna().tolist() == [True] * 3 + [False]
    assert rows["homogeneity_p"][3] < 1e-3 and 15 < rows["heterogeneity_percent"][3] < 35
    two = pd.DataFrame(direct_rows(captures[:2], singles[:2], [GROUP], [JOINT])).iloc[-1]
    assert two["points"] == 2 and "homogeneity_p" not in two
    # And so it stands on the page, with the map.
    (few,), (found,) = (point_maps(captures[:k], singles[:k], [GROUP], places_m) for k in (2, 3))
    assert few.text() == "Kinect, 2 points: a map of stiffness takes 3." and few.map is None
    assert "3 points: the points differ by more than their uncertainty (p < 0.0001" in found.text()
    assert [*found.rows()[2].values()][:3] == ["3", "0, 0, 30", "31.3 kPa (30.3 to 32.3)"]


FITS = {("zed", "01"): FIT}
CURVE = {"sensor": "curve", "capture": "back"}
CURVE_FILE = {"samples": {"depth_m": [0.0, 1e-3], "force_n": [0.0, 0.5], "fitted_n": [0.1, 0.4]}}


def test_a_fit_is_read_as_it_was_written_and_always_the_same(tmp_path):
    paths = tmp_path / "a.npz", tmp_path / "b.npz"
    for path in paths:
        save_fitted(path, {"01": FIT, "01-a02": FIT})
    assert paths[0].read_bytes() == paths[1].read_bytes()
    for name, value in vars(load_fitted(paths[0])["01-a02"]).items():
        np.testing.assert_array_equal(value, getattr(FIT, name))
    np.savez(paths[0], captures=np.array(["01"]))
    with pytest.raises(ValueError, match="a.npz: 01/time_s: expected an array, found none"):
        load_fitted(paths[0])


def test_force_has_fit_and_residual_of_captures_and_of_curves():
    table = data_tables.force_table(FITS, [CURVE], [CURVE_FILE])
    assert table["frame"].tolist() == [*FIT.frames, 0, 1] and table["frame"].dtype == int
    captured, curve = table[:-2], table[-2:]
    assert captured["time_s"].tolist() == pytest.approx(0.2 * FIT.frames)
    assert captured["depth_residual_m"].tolist() == pytest.approx(-0.25 * FIT.depth_m)
    assert curve["force_residual_n"].tolist() == pytest.approx([-0.1, 0.1])
    assert curve["depth_residual_m"].isna().all()


def test_motion_is_all_that_was_seen_with_the_model_where_it_was_compared():
    table = data_tables.motion_table(FITS, [MOTION]).set_index(["frame", "sample"])
    assert len(table) == MOTION.moved_m.size - 2
    compared = table[table["fitted_moved_m"].notna()]
    # Sample 1 was not seen in frame 15.
    assert set(compared.index) == {(k, s) for k in FIT.frames for s in (7, 1, 4)} - {(15, 1)}
    assert compared.loc[(15, 4), "moved_residual_m"] == pytest.approx(5e-5)
    assert compared.loc[(15, 4), "moved_m"] == MOTION.moved_m[15, 4]
    assert (compared["moved_expected_std_m"] == 1e-5).all()
    assert table["moved_expected_std_m"].count() == len(compared)
    other = replace(MOTION, cell_m=MOTION.cell_m + 1e-6)
    with pytest.raises(ValueError, match="samples: expected those of the motion, found others"):
        data_tables.motion_table(FITS, [other])


def test_the_profile_is_the_mean_of_rings_in_the_deepest_frame():
    moved, table = FIT.moved_m[15 - FIT.frames[0]], data_tables.profile_table(FITS)
    rings = set(FIT.distance_m[np.isfinite(moved)] // data_tables.RING_M)
    assert len(table) == len(rings) and table["samples"].sum() == 2
    assert (table["frame"] == 15).all() and (table["depth_m"] == 0.004).all()
    assert (table["samples"] * table["moved_m"]).sum() == pytest.approx(np.nansum(moved))


def test_the_package_says_of_each_column_its_kind_and_unit():
    """What has a unit is a number, though one table may have whole ones."""
    cells = {"capture": [1], "recommended": [True], "warnings": [np.nan], "depth_low_m": [2]}
    package = data_package.data_package("a", ".", {"summary.csv": pd.DataFrame(cells)})
    fields = package["resources"][0]["schema"]["fields"]
    assert [one["type"] for one in fields] == ["string", "boolean", "any", "number"]
    assert fields[-1]["description"].endswith("unit: m")


def test_regions_law_and_relaxation():
    """Of 2.45 deviations: 10 % of E are determined by the depth, 0.02 of nu by the surface."""
    alone = np.diag([100.0, 0.0]), np.diag([0.0, 2500.0])
    changes = {"regions": {"force": alone[0], "surface": alone[1], "both": sum(alone)}}
    changes |= {"relaxation": {"times_s": [1.0], "fractions": [0.2]}}
    found = estimate(40e3, 0.3, 4e3, **changes)
    plane, law, over_time = known(["kinect"], [found], [3.0]).axes
    depth, surface, _ = (c.get_paths()[0].vertices for c in plane.collections[1::2])
    reach = np.sqrt(5.991)
    assert np.ptp(np.log(depth[:, 1])) == pytest.approx(0.2 * reach, rel=0.02)
    assert np.ptp(surface[:, 0]) == pytest.approx(0.04 * reach, rel=0.02)
    peak = law.lines[0].get_xdata()[np.argmax(law.lines[0].get_ydata())]
    assert peak == pytest.approx(found["law"]["force"]["value"], abs=0.02)
    for line in over_time.lines[:2]:
        time, E = line.get_data()
        np.testing.assert_allclose(E, 40 * (1 - 0.2 * (1 - np.exp(-time))))


def words(html):
    """What a reader sees."""
    seen = re.sub(r"<(style|script).*?</\1>", "", html, flags=re.DOTALL)
    return " ".join(unescape(re.sub("<[^>]*>", " ", seen)).split())


def page(rows=ADVISED, captures=ONE):
    """First section and all of a page of the summary that the workflow itself makes."""
    given = {"joints": {"kinect": JOINT}, "settings": [{"setting": "a<b>"}], "checksums": [{}]}
    given |= {"pictures": {}, "glimpses": (), "files": {}}
    html = own_page("toy", summary(rows), captures, **given)
    return words(html.partition("</section>")[0]), words(html)


def test_numbers_verdicts_and_what_limits_them():
    first, text = page()
    assert "3.2 mm, after 1 s 42.5 kPa (39.5 to 45.5) identified" in first
    assert "38.1 kPa (35.1 to 41.1) identified" in first
    assert "0.38 (0.28 to 0.48) bounded" in first
    assert "depths of 0.4 to 4.0 mm and times up to 3.0 s." in first
    assert "All 6 checks of one capture passed." in first
    assert "noise of the depth (64 % of effective E*, 80 % of nu), clocks" in first
    assert "effective E* ±5.0 % instantaneous E ±5.0 % nu ±0.022" in text
    # The larger source in anything comes first: in nu, 4 to 1.
    assert "±0.2 mm effective E* 64 % instantaneous E 36 % nu 80 % clocks of camera" in text
    assert "and force ±10 ms effective E* 36 % instantaneous E 64 % nu 20 %" in text
    assert "E at 1 s 35.8 kPa 32.8 to 38.8 identified" in text
    assert "G 13.8 kPa" in text and "K 51.8 kPa or more" in text
    assert "mean strain of 18 %, 3.2 mm deep" in text
    assert "1.6 s after the touch (11 % per second) and at maximum depth after 2.0 s" in text
    # Frames, compared, loading and hold [s], force [N], depth [mm, radii], samples.
    assert "Kinect 08 26 12 2.0 1.0 2.00 4.0 0.80 80" in text
    assert (held(JOINT).rate_hz, held(JOINT).distance_m) == pytest.approx((5.0, 0.5))
    assert "a<b>" in text and "Simulated" not in text and "Warning" not in first


def test_warnings_simulated_captures_and_extrapolated_times_are_told():
    warned = JOINT | {"warnings": ["a", "b"]}
    short = held(JOINT, POSES.assign(time_s=POSES["time_s"] / 4))
    first, text = page(direct_rows([], [], [GROUP], [warned]), [short])
    assert "Warning: a. Warning: b." in first and "Simulated" in first
    assert "38.8 extrapolated: the captures end at 0.8 s" in text
    assert "extrapolated:" not in page(captures=[short, *ONE])[1]
    with pytest.raises(ValueError, match="recommended: expected a row for each sensor"):
        page(hertz_rows([CAPTURE], [HERTZ]))


def test_how_far_other_methods_are_from_the_recommended_estimate():
    """What a bound ended is not a method's answer."""
    rows = [
        row(CAPTURE, name, {STAR: Modulus(part * JOINT[STAR]["value"], None, None, None, "Pa")})
        | {"at_bound": part > 2}
        for name, part in {"hertz": 0.92, "hertz_free_contact": 1.06, "minimise": 2e3}.items()
    ]
    text = page([*ADVISED, *rows])[1]
    assert "by -8 to +6 % in E*" in text and "89.4 MPa (at a bound)" in text
    assert "(at a bound)" not in page([*ADVISED, *rows[:2]])[1]


def test_failed_checks_are_on_the_first_screen():
    residual = JOINT["residuals"][0] | {"motion_scale": 4.2, "depth_scale": 9.0}
    bad = {"residuals": [residual], "nuisances": [{"offset_m": -0.0153, "offset_std_m": 0.003}]}
    bad |= {"frames_beyond_lookup": [2], "converged": False}
    first, text = page(captures=[held(JOINT | bad, POSES.assign(detected=POSES["time_s"] < 12.9))])
    assert "6 of 6 checks of the recording failed" in first
    found = "9 of 10", "4.2 times", "9.0 times", "5.1 times", "2 of 14", "no"
    assert re.search(".*".join(f": {one}, expected " for one in found), first)
    assert re.search(".*".join(f"✗ {one}" for one in found), text)


def test_the_table_of_objects_has_values_verdicts_and_links_and_names_stay_text():
    rows = [ADVISED[0] | {"object": name} for name in ("toy_cow", "a<b", "c")]
    rows[2] |= {"youngs_modulus_pa": None}
    found = objects_page(rows, pages=["toy_cow", "x&y"])
    assert 'href="toy_cow/report.html"' in found and 'href="x&amp;y/report.html"' in found
    assert found.count('class="dot') == 2 and 'id="scene"' not in found
    text = words(found)
    assert "38.1 kPa (35.1 to 41.1) identified" in text and "0.38 (0.28 to 0.48) bounded" in text
    assert "A<b" in text and "Kinect, 1 capture" in text and "Simulated" not in text
    rows[0] |= {"provenance": "simulated"}
    assert "1 of 3" in words(objects_page(rows))


def test_the_surface_comes_back_in_the_object_frame_in_millimetres():
    """Of many frames some are shown, the deepest among them."""
    found = view(CAPTURE, SURFACE, HERTZ | {"range": {"last_frame": 19}})
    steps = np.frombuffer(b64decode(found["steps"]), dtype="<i2").reshape(-1, len(TOP), 3)
    places, at = found["middle_mm"] + found["step_mm"] * steps.astype(float), found["deepest_frame"]
    for frame, down_mm in ((0, -2.0), (at, 4.0)):
        expected = SURFACE.template_m * 1e3 - np.outer(TOP, [0, 0, down_mm])
        np.testing.assert_allclose(places[frame], expected, atol=2e-3)
    faces = np.frombuffer(b64decode(found["faces"]), dtype="<u4")
    assert faces.tolist() == SURFACE.faces.ravel().tolist()
    # Displacement counts from the first frame; there is no depth before contact.
    assert found["largest_mm"] == pytest.approx(6.0)
    assert found["frames"][0] == "1 of 26: 0.00 N"
    assert found["frames"][at] == "20 of 26: 2.00 N, 3.0 mm deep"
    assert len(places) == len(found["frames"]) == MOST_FRAMES + 1


def test_checksums_are_those_of_files_and_follow_names_and_content(tmp_path):
    def digest(path):
        return checksums({"a": str(path)})[0]["SHA-256"]

    file = tmp_path / "a"
    file.write_text("x")
    assert digest(file) == hashlib.sha256(b"x").hexdigest()
    first = digest(tmp_path)
    (tmp_path / ".b").write_text("of an editor")
    assert digest(tmp_path) == first
    file = file.rename(tmp_path / "c")
    renamed = digest(tmp_path)
    file.write_text("y")
    assert len({first, renamed, digest(tmp_path)}) == 3


def test_text_stays_text_and_nothing_comes_from_elsewhere():
    text = pages.page("| name |\n|---|\n| a<b |\n\n<script>x</script>\n", title="t")
    assert "a&lt;b" in text and "<script" not in text and not re.search("(src|href)=", text)
