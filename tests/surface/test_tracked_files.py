"""The tracked surface as files: NPZ, the time series, and the description beside them."""

import json
from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
import trimesh
from palpate.surface.options import ElasticTracking
from palpate.surface.pose import to_camera, to_object
from palpate.surface.series import INDEX, save_series
from palpate.surface.tracked import Tracked, describe, load_tracked, save_tracked
from scipy.spatial.transform import Rotation

FRAMES = 5
TIME_S = np.array([0.0, 0.171, 0.330, 0.499, 0.668])


@pytest.fixture
def tracked():
    """A ball that moves and shrinks in front of a camera."""
    rng = np.random.default_rng(0)
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [130, 10, 5], degrees=True).as_matrix()
    pose[:3, 3] = [0.01, -0.02, 0.65]
    rest = np.asarray(ball.vertices)
    moved = [rest * (1 - 0.01 * k) + [0, 0, 0.001 * k] for k in range(FRAMES)]
    known = rng.random((FRAMES, len(rest))) < 0.5, pose, np.linspace(1e-4, 2e-4, FRAMES), rest[7], 2
    moved = to_camera(pose, np.array(moved))
    return Tracked(rest, np.asarray(ball.faces), to_camera(pose, rest), moved, *known)


@pytest.fixture
def tips(tracked):
    return tracked.rest_m[7] + np.linspace(0.002, -0.002, FRAMES)[:, None] * np.ones(3)


def contents(folder):
    """Bytes of a folder's files, by name."""
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_vtk_reads_every_step(tmp_path, tracked, tips):
    save_series(tmp_path / "series", tracked, time_s=TIME_S, tips_m=tips)
    reader = pv.get_reader(tmp_path / "series" / INDEX)
    assert reader.time_values == TIME_S.tolist()
    for k in range(FRAMES):
        reader.set_active_time_point(k)
        surface = reader.read()[0]
        place = to_object(tracked.camera_from_object, tracked.vertices_m[k])
        expected = {
            "displacement_m": place - tracked.template_m,
            "distance_moved_m": np.linalg.norm(place - tracked.template_m, axis=1),
            "observed": tracked.observed[k],
        }
        assert np.allclose(surface.points, place, atol=5e-8)
        for name, values in expected.items():
            assert np.allclose(surface.point_data[name], values, atol=5e-8), name
        assert (surface.regular_faces == tracked.faces).all()
        assert surface.field_data["residual_m"] == tracked.residual_m[k]
        assert (surface.field_data["contact_point_m"] == tracked.contact_point_m).all()
        tip = to_object(tracked.camera_from_object, tips[k])
        assert np.allclose(surface.field_data["tip_m"], tip, atol=1e-15)


def test_same_surface_same_bytes_whenever_written(tmp_path, tracked, tips):
    first, second = tmp_path / "first", tmp_path / "second"
    save_series(first, tracked, time_s=TIME_S, tips_m=tips)
    save_series(second, tracked, time_s=TIME_S, tips_m=tips)
    assert contents(first) == contents(second) and len(contents(first)) == FRAMES + 1
    other = replace(tracked, residual_m=tracked.residual_m + 1e-6)
    save_series(second, other, time_s=TIME_S, tips_m=tips)
    assert contents(first) != contents(second)


def test_a_series_refuses_other_frames(tmp_path, tracked, tips):
    path = tmp_path / "series"
    for time_s, tips_m, line in (
        (TIME_S[:4], tips, r"time_s: expected 5 times, found shape \(4,\)"),
        (TIME_S[::-1], tips, "time_s: expected increasing times"),
        (TIME_S, tips[:4], r"tips_m: expected shape \(5, 3\), found \(4, 3\)"),
    ):
        with pytest.raises(ValueError, match=line):
            save_series(path, tracked, time_s=time_s, tips_m=tips_m)
    assert not path.exists()


def test_a_surface_keeps_its_prior_and_older_files_have_none(tmp_path, tracked):
    held = replace(tracked, prior='{"poisson_ratio": 0.3}')
    save_tracked(tmp_path / "new.npz", held)
    found = load_tracked(tmp_path / "new.npz")
    assert (found.prior, found.contact_frame) == (held.prior, 2)
    assert (found.vertices_m == tracked.vertices_m).all()
    fields = {name: value for name, value in vars(tracked).items() if name != "prior"}
    np.savez_compressed(tmp_path / "old.npz", **fields)
    assert load_tracked(tmp_path / "old.npz").prior == ""


def test_description(tracked):
    residual = tracked.residual_m.copy()
    residual[1] = np.nan
    held = replace(tracked, residual_m=residual, prior='{"poisson_ratio": 0.3}')
    content = describe(held, tracker="mine", options=ElasticTracking(poisson_ratio=0.4))
    assert content["prior"] == {"poisson_ratio": 0.3}
    assert content["options"]["poisson_ratio"] == 0.4
    assert content["observed_vertices"] == tracked.observed.sum(axis=1).tolist()
    assert content["residual_rms_m"][:2] == [tracked.residual_m[0], None]
    json.dumps(content, allow_nan=False)
