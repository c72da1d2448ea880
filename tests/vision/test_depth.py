"""Depth of each kind of sensor."""

import cv2
import numpy as np
import pytest
from palpate.vision.camera import camera_from_spec
from palpate.vision.clouds import scene_cloud
from palpate.vision.depth import stereo_depth, stereo_disparity


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
    found = scene_cloud({"depth": image}, sensor).points_m
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
    points = scene_cloud({"left": left, "right": right}, sensor, wanted).points_m
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
