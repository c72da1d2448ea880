"""Measures of trackers on surfaces whose errors are known."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import trimesh
from palpate.solid.indentation_table import IndentationModel
from palpate.surface.pose import to_camera
from palpate.surface.tracked import Tracked
from scipy.spatial.transform import Rotation
from validation.indentation import displacement_ratios
from validation.tracking import (
    accuracy_row,
    averages,
    tracked_errors,
    untracked,
    vertex_errors,
    volume_changes,
)

RADIUS_M = 0.05
SHIFT_M = np.array([0.0, 0.003, 0.004])  # 5 mm long
GROWTH = np.array([0.0, -0.02, -0.05, -0.04])
DEPTH_M = np.array([-0.001, 0.002, 0.005, 0.004])


@pytest.fixture
def pose():
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [130, 10, 5], degrees=True).as_matrix()
    pose[:3, 3] = [0.01, -0.02, 0.65]
    return pose


@pytest.fixture
def ball():
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS_M)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


@pytest.fixture
def truth(ball, pose):
    """A ball that shrinks about its centre."""
    vertices, faces = ball
    return {
        "camera_from_object": pose,
        "surface_rest_m": vertices,
        "surface_faces": faces,
        "surface_m": vertices * (1 + GROWTH[:, None, None]),
        "depth_m": DEPTH_M,
    }


@pytest.fixture
def right(ball, pose, truth):
    """A tracker that makes no error; the upper half is observed."""
    vertices, faces = ball
    return Tracked(
        template_m=vertices,
        faces=faces,
        rest_m=to_camera(pose, vertices),
        vertices_m=to_camera(pose, truth["surface_m"]),
        observed=np.tile(vertices[:, 2] > 0, (len(GROWTH), 1)),
        camera_from_object=pose,
        residual_m=np.zeros(len(GROWTH)),
        contact_point_m=np.array([0.0, 0.0, RADIUS_M]),
        contact_frame=1,
    )


def moved(tracked, shift):
    """The same with some frames' vertices shifted (camera frame)."""
    return replace(tracked, vertices_m=tracked.vertices_m + shift)


def test_no_error_is_found_where_there_is_none(truth, right):
    errors = vertex_errors(truth, right)
    for lengths in (errors[kind] for kind in ("place", "displacement", "surface")):
        assert lengths.shape == right.observed.shape
        assert lengths.max() < 1e-7
    row = accuracy_row(truth, right)
    assert row["volume_change_of_true_percent"] == pytest.approx(100, abs=1e-4)


def test_a_shifted_surface_is_off_by_the_shift(truth, right):
    row = accuracy_row(truth, moved(right, SHIFT_M))
    for frames in ("", "contact_"):
        for region in ("all", "observed", "unobserved", "dent"):
            for kind in ("displacement_mean", "displacement_rms", "place_mean", "place_rms"):
                assert row[f"{frames}{kind}_{region}_mm"] == pytest.approx(5.0, abs=1e-3)
        # Seen from the surface, only the shift along the normals counts: |cos| has mean 1/2.
        assert row[f"{frames}surface_mean_all_mm"] == pytest.approx(2.5, rel=0.06)


def test_an_error_of_the_alignment_stays_out_of_the_displacement(truth, right):
    """The template lies 5 mm off and the tracker moves it as the truth moves."""
    shifted = replace(moved(right, SHIFT_M), rest_m=right.rest_m + SHIFT_M)
    row = accuracy_row(truth, shifted)
    assert row["place_mean_all_mm"] == pytest.approx(5.0, abs=1e-3)
    # The displacement, 2.5 mm along the radius, is another where the template lies.
    assert row["displacement_mean_all_mm"] < 0.05 * row["place_mean_all_mm"]


def test_regions_are_measured_apart(truth, right):
    shift = np.where(right.observed[..., None], 0.001, 0.004) * np.array([0.6, 0.0, 0.8])
    row = accuracy_row(truth, moved(right, shift))
    seen = right.observed[0].mean()
    assert row["place_mean_observed_mm"] == pytest.approx(1.0, abs=1e-3)
    assert row["place_mean_unobserved_mm"] == pytest.approx(4.0, abs=1e-3)
    assert row["place_mean_all_mm"] == pytest.approx(seen + 4 * (1 - seen), abs=1e-3)
    rms = np.sqrt(seen + 16 * (1 - seen))
    assert row["place_rms_all_mm"] == pytest.approx(rms, abs=1e-3)
    assert row["place_mean_dent_mm"] == pytest.approx(1.0, abs=1e-3)


def test_no_tracking_is_off_by_the_true_displacement(truth, right):
    still = untracked(right)
    found = accuracy_row(truth, still)
    assert found["frame"] == 2
    assert found["displacement_mean_all_mm"] == pytest.approx(2.5, abs=1e-3)
    mean = -1e3 * RADIUS_M * GROWTH[DEPTH_M > 0].mean()
    assert found["contact_displacement_mean_all_mm"] == pytest.approx(mean, abs=1e-3)
    assert found["volume_change_of_true_percent"] == pytest.approx(0, abs=1e-6)
    assert (still.observed == right.observed).all()


def test_volumes_are_those_of_the_balls(truth, right):
    found, true = volume_changes(truth, right)
    whole = trimesh.Trimesh(right.template_m, right.faces).volume
    assert true == pytest.approx(whole * ((1 + GROWTH) ** 3 - 1), rel=1e-9)
    assert found == pytest.approx(true, abs=1e-12)
    half = replace(right, vertices_m=(right.vertices_m + right.rest_m) / 2)
    row = accuracy_row(truth, half)
    ratio = ((1 + GROWTH[2] / 2) ** 3 - 1) / ((1 + GROWTH[2]) ** 3 - 1)
    assert row["volume_change_of_true_percent"] == pytest.approx(100 * ratio, rel=1e-6)


def test_one_frame_as_the_accuracy_of_every_stage_takes_it(truth, right):
    found, still = tracked_errors(truth, moved(right, SHIFT_M), 2)
    assert found == pytest.approx(0.005 * np.ones(len(found)), abs=1e-6)
    assert still == pytest.approx(0.0025 * np.ones(len(still)), abs=1e-6)


def test_a_region_without_vertices_has_no_figures(truth, right):
    row = accuracy_row(truth, replace(right, observed=np.ones_like(right.observed)))
    assert np.isnan(row["place_mean_unobserved_mm"])
    assert row["place_mean_observed_mm"] == pytest.approx(0.0, abs=1e-3)


def test_averages_are_over_captures(truth, right):
    known = {"object": "ball", "sensor": "kinect", "tracker": "study", "provenance": "simulated"}
    rows = [
        known | accuracy_row(truth, moved(right, shift)) | {"seconds_per_frame": 1.0}
        for shift in (0, 2 * SHIFT_M)
    ]
    assert rows[0]["contact_place_mean_all_mm"] == pytest.approx(0.0, abs=1e-3)
    assert "contact_frame" not in rows[0]
    found = averages(pd.DataFrame(rows))
    assert len(found) == 1
    assert found.loc[0, "captures"] == 2
    assert found.loc[0, "place_mean_all_mm"] == pytest.approx(5.0, abs=1e-3)


def test_bad_truth_is_refused(truth, right):
    with pytest.raises(ValueError, match="surface_m: expected 4 frames as tracked, found 3"):
        accuracy_row(truth | {"surface_m": truth["surface_m"][:3]}, right)
    with pytest.raises(ValueError, match="depth_m: expected a frame in contact, found none"):
        accuracy_row(truth | {"depth_m": -np.ones(4)}, right)


def test_displacements_of_a_table_by_rings(ball):
    """Of a table that is 3 % off within 20 mm of the contact, 5 % beyond; no ring is made up."""
    rest, faces = ball
    point, depth = np.array([0, 0, RADIUS_M]), np.array([0.0, 0.003, 0.006])
    lab = {"surface_rest_m": rest, "surface_faces": faces, "depth_m": depth}
    lab["surface_displacement_m"] = depth[:, None, None] * rest
    away = np.linalg.norm(rest - point, axis=1)
    off = lab["surface_displacement_m"] * np.where(away > 0.02, 1.05, 1.03)[:, None]
    unit = np.ones((1, 2, 3))
    table = IndentationModel(
        point, -point, 0.006, ("neo_hookean",), np.array([0.2, 0.4]), depth,
        unit, rest, faces, np.broadcast_to(off, (1, 2, *off.shape)),
    )  # fmt: skip
    found = displacement_ratios(table, lab, 0, 0.3, 0.005)
    assert list(found.values()) == pytest.approx([1.03, 1.05, 1.05], abs=1e-3)
    small = {"surface_rest_m": rest / 10, "surface_faces": faces} | {
        name: lab[name] for name in ("depth_m", "surface_displacement_m")
    }
    near = replace(table, surface_rest_m=rest / 10, point_m=point / 10)
    assert list(displacement_ratios(near, small, 0, 0.3, 0.005)) == ["displacement_ratio_8_20_mm"]
