"""Depth of each kind of sensor, clouds and the table's plane."""

import cv2
import numpy as np
import pytest
from palpate.vision.camera import camera_from_spec
from palpate.vision.clouds import (
    Cloud,
    ProbePlace,
    Reach,
    object_cloud,
    read_clouds,
    save_clouds,
    scene_points,
)
from palpate.vision.depth import stereo_depth, stereo_disparity
from palpate.vision.support_plane import fit_support_plane, height_above

OPTIONS = {
    "lowest_m": 0.004,
    "voxel_m": 0.002,
    "normal_neighbours": 30,
    "cluster_gap_m": 0.01,
}
REACH = Reach(np.array([-0.05, 0, 0.7]), 0.2, 0.2)


@pytest.mark.parametrize("encoding", ["kinect_disparity", "millimetre"])
def test_points_of_a_depth_image_lie_in_the_colour_cameras_frame(sensors, encoding):
    """Two pixels within the range; nearer and farther ones are left out."""
    sensor = dict(sensors["kinect"], range_m=[0.5, 1.0])
    depth = sensor["depth"] = dict(sensor["depth"], encoding=encoding, distortion=[0.0] * 5)
    image = np.zeros((480, 640), np.uint16)
    kinect = encoding == "kinect_disparity"
    # d = 136.25 - d'/8 = 62.5 px and 50 px; 120 px is nearer than half a metre, 20 px too far.
    image[:] = 2047 if kinect else 0
    places, counts = [(100, 200), (300, 400), (10, 10), (20, 20)], [590, 690, 130, 930]
    metres = [584.6213 * 0.075 / disparity for disparity in (62.5, 50.0, 120.0, 20.0)]
    for place, count, z in zip(places, counts, metres, strict=True):
        image[place] = count if kinect else round(1e3 * z)
    found = scene_points({"depth": image}, sensor)
    expected = []
    for (row, column), z in zip(places[:2], metres, strict=False):
        z = z if kinect else round(z, 3)
        x = (column - depth["cx_px"]) / depth["fx_px"] * z
        y = (row - depth["cy_px"]) / depth["fy_px"] * z
        expected.append((np.array(depth["color_from_depth"]) @ [x, y, z, 1])[:3])
    assert found == pytest.approx(np.array(expected))


def test_points_of_a_stereo_pair_lie_in_the_left_cameras_frame(sensors):
    sensor = with_stereo(sensors["bumblebee"], "semi_global", "least_squares", (80, 128))
    sensor["color"] = dict(sensor["color"], width_px=500, height_px=120)
    left, right = rendered_pair(np.full((120, 500), 100.5))
    wanted = np.zeros((120, 500), bool)
    wanted[50:70, 250:270] = True
    points = scene_points({"left": left, "right": right}, sensor, wanted)
    optics = sensor["color"]
    z = optics["fx_px"] * sensor["stereo"]["baseline_m"] / 100.5
    assert np.median(points[:, 2]) == pytest.approx(z, rel=1e-3)
    camera = camera_from_spec(optics)
    pixels = np.round(camera.project(points)).astype(int)
    seen = np.zeros((120, 500), bool)
    seen[pixels[:, 1], pixels[:, 0]] = True
    assert seen[wanted].mean() > 0.95


STEREO = [("block", "matcher"), ("block", "least_squares")]
STEREO += [("semi_global", "matcher"), ("semi_global", "least_squares")]


def with_stereo(sensor, method, subpixel, disparities=None):
    """The sensor with these options, and the range that first and last disparity [px] ask for."""
    product = sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]
    first, last = disparities or [product / depth_m for depth_m in reversed(sensor["range_m"])]
    range_m = [product / last, product / first if first else np.inf]
    stereo = dict(sensor["stereo"], method=method, subpixel=subpixel)
    return dict(sensor, stereo=stereo, range_m=range_m)


def rendered_pair(disparity):
    """Left and right image of a textured surface with this disparity of the left one [px]."""
    height, width = disparity.shape
    rng = np.random.default_rng(2)
    right = cv2.GaussianBlur(rng.uniform(0, 255, (height, width)).astype(np.float32), (0, 0), 1.2)
    right = np.clip((right - 127) * 3 + 127, 0, 255)
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    maps = (column - disparity).astype(np.float32), row.astype(np.float32)
    left = cv2.remap(right, *maps, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REPLICATE)
    return tuple(np.clip(image + 0.5, 0, 255).astype(np.uint8) for image in (left, right))


@pytest.mark.parametrize(("method", "subpixel"), STEREO)
def test_stereo_depth_of_a_textured_plane(sensors, method, subpixel):
    sensor = with_stereo(sensors["bumblebee"], method, subpixel)
    left, right = rendered_pair(np.full((300, 900), 140.5))
    depth = stereo_depth(left, right, sensor)
    inner = depth[20:-20, 260:-20]
    assert np.isfinite(inner).mean() > 0.95
    assert np.nanmedian(np.abs(inner - 790 * 0.12 / 140.5)) < 1e-3


@pytest.mark.parametrize("method", ["block", "semi_global"])
def test_refinement_follows_a_slanted_plane(sensors, method):
    column, row = np.meshgrid(np.arange(900), np.arange(300))
    disparity = 110 + 0.05 * column + 0.03 * row
    pair, inner = rendered_pair(disparity), np.s_[20:-20, 300:-20]
    error = {}
    for subpixel in ("matcher", "least_squares"):
        found = stereo_disparity(*pair, with_stereo(sensors["bumblebee"], method, subpixel))
        assert np.isfinite(found[inner]).mean() > 0.95
        error[subpixel] = np.nanmedian(np.abs(found - disparity)[inner])
    assert error["least_squares"] < 0.02
    assert error["least_squares"] < error["matcher"] / 3


@pytest.mark.parametrize(("method", "subpixel"), STEREO)
def test_what_one_camera_sees_is_left_out(sensors, method, subpixel):
    left, right = rendered_pair(np.full((300, 900), 100.0))
    near = rendered_pair(np.full((300, 900), 150.0))[1][::-1]
    right[100:200, 350:500] = near[100:200, 350:500]
    left[100:200, 500:650] = near[100:200, 350:500]
    found = stereo_disparity(left, right, with_stereo(sensors["bumblebee"], method, subpixel))
    assert np.isnan(found[110:190, 455:495]).mean() > 0.9
    assert np.nanmedian(found[110:190, 510:640]) == pytest.approx(150, abs=0.1)
    rest = np.abs(found[:80, 260:-20] - 100)
    assert np.nanmax(rest) < 1


@pytest.mark.parametrize("method", ["block", "semi_global"])
def test_matches_that_the_other_image_does_not_confirm_are_left_out(sensors, method):
    """Of two unlike images a sixth is matched by chance, without the way back two fifths."""
    left, right = rendered_pair(np.full((120, 500), 100.5))
    sensor = with_stereo(sensors["bumblebee"], method, "matcher")
    sensor["stereo"]["speckle_size_px"] = 1
    found = stereo_disparity(left, np.ascontiguousarray(right[::-1]), sensor)
    assert np.isfinite(found).mean() < 0.25


@pytest.mark.parametrize(
    ("option", "known"), [("method", "block"), ("subpixel", "matcher"), ("highlights", "drop")]
)
def test_unknown_stereo_option(sensors, option, known):
    sensor = sensors["bumblebee"]
    sensor = dict(sensor, stereo=dict(sensor["stereo"], **{option: "best"}))
    image = np.zeros((64, 300), np.uint8)
    with pytest.raises(ValueError, match=f"{option}: expected .*{known}.*found 'best'"):
        stereo_disparity(image, image, sensor)


def aloe(request):
    """Pair (RGB), true disparity of the left image, and the range to search [px]."""
    folder = request.getfixturevalue("root") / "tests/real/aloe"
    left, right = (cv2.imread(str(folder / f"{side}.jpg")) for side in ("left", "right"))
    truth = cv2.imread(str(folder / "disparity_2px.png"), cv2.IMREAD_GRAYSCALE) / np.float32(2)
    return left[..., ::-1], right[..., ::-1], np.where(truth > 0, truth, np.nan), (16, 112)


def motorcycle(request):
    folder = request.getfixturevalue("more_real_data") / "stereo_gt/motorcycle"
    names = (str(folder / f"motorcycle_{side}.png") for side in ("left", "right"))
    left, right = map(cv2.imread, names)
    with np.load(folder / "motorcycle_disp.npz") as data:
        truth = data[data.files[0]].astype(np.float32)
    return left[..., ::-1], right[..., ::-1], np.where(np.isfinite(truth), truth, np.nan), (0, 64)


def quality(found, truth):
    """Median error [px], share of errors above a pixel, share of known pixels that have a match."""
    error = np.abs(found - truth)[np.isfinite(found) & np.isfinite(truth)]
    return np.median(error), (error > 1).mean(), error.size / np.isfinite(truth).sum()


def plain_semi_global(left, right, first, last):
    """OpenCV's matcher with its own validation: 6.1 % and 7.9 % more than a pixel off."""
    matcher = cv2.StereoSGBM.create(
        *(first, last - first, 5),
        P1=8 * 3 * 5**2,
        P2=32 * 3 * 5**2,
        disp12MaxDiff=1,
        uniquenessRatio=10,
        speckleWindowSize=100,
        speckleRange=2,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    raw = matcher.compute(*(np.ascontiguousarray(image[..., ::-1]) for image in (left, right)))
    return np.where(raw >= first * 16, raw / 16, np.nan)


@pytest.fixture(scope="module", params=[aloe, motorcycle])
def real_pair(request):
    """Pair, its truth, the range to search, and what plain semi-global matching finds."""
    left, right, truth, (first, last) = request.param(request)
    plain = plain_semi_global(left, right, first, last)
    return (left, right), truth, (first, last - 0.1), plain


# Coverage is a share of plain semi-global matching's. Unrefined blocks are the study's own way.
@pytest.mark.parametrize(
    ("method", "subpixel", "coverage"),
    [
        ("semi_global", "matcher", 1.0),
        ("semi_global", "least_squares", 0.9),
        ("block", "least_squares", 0.85),
        ("block", "matcher", 0.9),
    ],
)
def test_real_pairs_no_worse_than_plain_semi_global(sensors, real_pair, method, subpixel, coverage):
    pair, truth, disparities, plain = real_pair
    sensor = with_stereo(sensors["bumblebee"], method, subpixel, disparities)
    found = stereo_disparity(*pair, sensor)
    median, outliers, covered = quality(found, truth)
    plain_median, plain_outliers, plain_covered = quality(plain, truth)
    assert outliers <= plain_outliers
    assert covered >= coverage * plain_covered
    assert median <= plain_median


def coloured_pair(highlight_px):
    """Pair of a surface at 100 px with a texture in red and green, and a white highlight.

    The highlight is on both, at a disparity of its own.
    """
    rng = np.random.default_rng(4)
    texture = cv2.GaussianBlur(rng.normal(0, 9, (200, 500)), (0, 0), 1.5)
    base = np.stack([140 + 3 * texture, 90 + 2 * texture, 30 + 0 * texture], axis=-1)
    y, x = np.mgrid[:200, :500]
    pair = []
    for disparity, at in ((0, 340), (100, 340 - highlight_px)):
        bright = 90 * np.exp(-((x - at) ** 2 + (y - 100) ** 2) / (2 * 14.0**2))
        image = np.roll(base, -disparity, axis=1) + bright[..., None]
        image += rng.normal(0, 0.8, image.shape)
        pair.append(np.clip(image, 0, 255).round().astype(np.uint8))
    return pair


def test_a_highlight_is_a_hole(sensors):
    """It lies where the lamp's mirror image does, and that is not the surface."""
    sensor = with_stereo(sensors["bumblebee"], "semi_global", "least_squares", (80, 128))
    there = np.zeros((200, 500), bool)
    there[92:109, 332:349] = True
    pair = coloured_pair(highlight_px=92)
    grey = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in pair]
    found, fooled = stereo_disparity(*pair, sensor), stereo_disparity(*grey, sensor)
    assert (np.abs(fooled[there] - 100) > 1).mean() > 0.3
    assert np.isnan(found[there]).mean() > 0.7
    seen = np.s_[20:180, 150:480]
    assert (np.abs(found[seen] - 100) > 1).sum() < (np.abs(fooled[seen] - 100) > 1).sum() / 2
    assert np.isfinite(found[20:180, 150:300]).mean() > 0.95
    found = stereo_disparity(*coloured_pair(highlight_px=100), sensor)
    assert np.isfinite(found[there]).mean() > 0.95
    kept = dict(sensor, stereo=dict(sensor["stereo"], highlights="keep"))
    as_grey = (np.isfinite(fooled[there]), np.isfinite(stereo_disparity(*pair, kept)[there]))
    assert np.array_equal(*as_grey)


def test_only_what_is_wanted_is_matched(sensors):
    sensor = with_stereo(sensors["bumblebee"], "semi_global", "least_squares", (80, 128))
    left, right = coloured_pair(highlight_px=100)
    wanted = np.zeros((200, 500), bool)
    wanted[80:120, 330:390] = True
    whole, part = (stereo_depth(left, right, sensor, chosen) for chosen in (None, wanted))
    assert np.nanmax(np.abs(part / whole - 1)[wanted]) < 1e-3
    assert np.isfinite(part[wanted]).all()
    assert np.isnan(part[:, :100]).all()
    everything = stereo_depth(left, right, sensor, np.zeros_like(wanted))
    assert np.array_equal(everything, whole, equal_nan=True)


def test_support_plane_among_clutter():
    rng = np.random.default_rng(1)
    normal = np.array([0.1, -0.7, -0.7])
    normal /= np.linalg.norm(normal)
    ground = rng.uniform(-0.4, 0.4, (5000, 2))
    a, b = np.linalg.svd(normal[None])[2][1:]
    points = [0, 0, 0.8] + ground @ np.stack([a, b]) + rng.normal(0, 1e-3, (5000, 1)) * normal
    clutter = [0, 0, 0.7] + rng.uniform(-0.1, 0.1, (1500, 3))
    plane = fit_support_plane(
        np.concatenate([points, clutter]), inlier_distance_m=0.004, rng=np.random.default_rng(0)
    )
    assert np.degrees(np.arccos(plane[:3] @ normal)) < 0.1
    assert abs(height_above(plane, np.array([[0, 0, 0.8]]))[0]) < 3e-4
    with pytest.raises(ValueError, match="at least 100 points, found 3"):
        fit_support_plane(points[:3], inlier_distance_m=0.01, rng=rng)


def test_false_matches_are_no_table():
    """What a stereo head makes of a table of one colour: depths of any size."""
    rng = np.random.default_rng(2)
    rays = np.column_stack([rng.uniform(-0.5, 0.5, (20000, 2)), np.ones(20000)])
    points = rays / rng.uniform(1 / 1.5, 1 / 0.4, (20000, 1))
    with pytest.raises(ValueError, match="25% or more .* 3% .a table without a pattern"):
        fit_support_plane(points, inlier_distance_m=0.004, rng=rng)


@pytest.fixture
def wall(sensors):
    """Points on a plane 0.7 m before the camera, seen in the middle of its image."""
    camera = camera_from_spec(sensors["kinect"]["color"])
    grid = np.stack(np.meshgrid(np.linspace(-0.1, 0.1, 120), np.linspace(-0.1, 0.1, 120)), -1)
    points = np.column_stack([grid.reshape(-1, 2), np.full(120 * 120, 0.7)])
    mask = np.zeros((480, 640), bool)
    mask[:, :311] = True
    return camera, points, mask


def test_cloud_is_cut_thinned_and_oriented(wall, probe):
    camera, points, mask = wall
    place = ProbePlace(np.array([-0.05, 0, 0.7]), np.array([0, 1.0, 0]), np.array([0, -0.5, 0.7]))
    plane = np.array([0, -1.0, 0, 0.06])
    arguments = camera, plane, place, probe["exclusion"], REACH
    cloud = object_cloud(points, mask, *arguments, **OPTIONS)
    assert cloud.points_m[:, 0].max() < 0.002
    assert cloud.points_m[:, 1].max() < 0.06 - OPTIONS["lowest_m"] + 1e-9
    assert np.allclose(cloud.normals, [0, 0, -1], atol=1e-6)
    with pytest.raises(ValueError, match="expected points of the object, found 0"):
        object_cloud(points, ~(mask | True), *arguments, **OPTIONS)


def test_a_piece_apart_is_not_the_object(wall, probe):
    camera, points, mask = wall
    stray = np.array([-0.05, 0.0, 0.5]) + np.random.default_rng(0).normal(0, 0.001, (60, 3))
    place = ProbePlace(np.array([-0.05, 0, 0.9]), np.array([0, 1.0, 0]), np.array([0, -0.5, 0.9]))
    plane = np.array([0, -1.0, 0, 0.06])
    both = np.concatenate([points, stray])
    cloud = object_cloud(both, mask, camera, plane, place, probe["exclusion"], REACH, **OPTIONS)
    assert np.allclose(cloud.points_m[:, 2], 0.7)


def test_clouds_round_trip(tmp_path):
    rng = np.random.default_rng(0)
    clouds = [Cloud(rng.normal(size=(n, 3)), rng.normal(size=(n, 3))) for n in (4, 7, 2)]
    save_clouds(tmp_path / "clouds.npz", iter(clouds))
    again = read_clouds(tmp_path / "clouds.npz")
    assert len(again) == 3 and len(again[1:]) == 2
    for one, other in zip(clouds, again, strict=True):
        assert np.allclose(one.points_m, other.points_m, atol=1e-6)
        assert np.allclose(one.normals, other.normals, atol=1e-6)


def test_a_damaged_film_is_refused_at_its_frame(tmp_path):
    rng, path = np.random.default_rng(0), tmp_path / "clouds.npz"
    save_clouds(path, [Cloud(rng.normal(size=(50, 3)), rng.normal(size=(50, 3)))] * 3)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)
    with pytest.raises(ValueError, match=f"^{path}: .*(damaged|found none)"):
        list(read_clouds(path))


def test_a_cloud_of_fewer_points_than_were_written_is_refused(tmp_path):
    cloud, path = Cloud(np.zeros((50, 3)), np.zeros((50, 3))), tmp_path / "clouds.npz"
    save_clouds(path, [cloud])
    arrays = {name: array[: len(array) // 2] for name, array in np.load(path).items()}
    arrays["000000/count"] = np.array([50])
    np.savez(path, **arrays)
    with pytest.raises(ValueError, match="points_m: expected as many as count, .50., found 25"):
        read_clouds(path)[0]


def test_no_points_project_to_no_pixels(sensors):
    camera = camera_from_spec(sensors["kinect"]["color"])
    assert camera.project(np.zeros((0, 3))).shape == (0, 2)
