"""Options and specifications: how they are read, and what is wrong, one line each."""

import copy
from functools import reduce
from operator import getitem
from typing import Annotated, Literal

import cv2
import numpy as np
import pytest
import yaml
from palpate.capture.devices import MODELS, read_device
from palpate.config.model import Count, FileName, Model, NotNegative, Positive, constant, problems
from palpate.config.object import ObjectSpec
from palpate.config.probe import FAMILIES, ProbeSpec
from palpate.config.sensor import SensorSpec
from palpate.yaml_files import load_yaml
from pydantic import Field, model_validator
from virtual_lab.specification import Lab, Ranges


class Inner(Model):
    """A block in a block."""

    place_m: tuple[NotNegative, NotNegative] = (0.0, 1.0)
    rule: Literal["one", "two"] = "one"
    low: float = 0
    high: float = 1

    @model_validator(mode="after")
    def _in_order(self):
        if self.low >= self.high:
            raise ValueError(f"low: expected below high, {self.high:g}, found {self.low:g}")
        return self


class Outer(Model):
    """A block."""

    name: str = Field(min_length=1, description="a name of it")
    count: Count = Field(3, ge=1)
    edge_m: Positive | None = None
    share: Positive | tuple[Positive, Positive] = 1
    inner: Inner = Field(default_factory=Inner)
    points: dict[FileName, Inner] = Field(default_factory=dict)
    marks: Annotated[tuple[str, ...], Field(min_length=1)] = ("a",)
    flat: bool = True
    counts: tuple[Count, ...] = ()


LINES = [
    ({"count": 0}, "count: expected a number >= 1, found 0"),
    ({"count": 10**9}, "count: expected a number <= 1000000, found 1000000000"),
    ({"count": 2.5}, "count: expected an integer, found 2.5"),
    ({"count": 0.0}, "count: expected a number >= 1, found 0"),
    ({"count": float("nan")}, "count: expected an integer, found nan"),
    ({"count": True}, "count: expected an integer, found True"),
    ({"count": "3"}, "count: expected an integer, found '3'"),
    ({"edge_m": 0}, "edge_m: expected a number > 0 or null, found 0"),
    ({"edge_m": float("inf")}, "edge_m: expected a finite number or null, found inf"),
    ({"flat": 1}, "flat: expected a boolean, found 1"),
    ({"marks": []}, "marks: expected at least 1 entries, found []"),
    ({"marks": "ab"}, "marks: expected a list, found 'ab'"),
    ({"name": ""}, "name: expected a text of at least 1 characters, found ''"),
    ({"name": "FILL_IN"}, "name: expected a name of it, found nothing filled in yet"),
    ({"name": None}, "name: expected a text, found None"),
    ({"inner": {"rule": "three"}}, "inner.rule: expected one of one, two, found 'three'"),
    ({"inner": {"place_m": [1]}}, "inner.place_m.1: expected a value, found nothing"),
    ({"inner": {"place_m": [1, -1]}}, "inner.place_m.1: expected a number >= 0, found -1"),
    ({"inner": {"low": 2}}, "inner.low: expected below high, 1, found 2"),
    ({"inner": [1]}, "inner: expected a mapping, found [1]"),
    ({"points": {"p": {"x": 1}}}, "points.p.x: expected one of high, low, place_m, rule, found x"),
    ({"points": {1: {}}}, "points.1: expected a key in quotes, found the bare 1"),
    (
        {"points": {"P": {}}},
        "points: expected a name of small letters, digits and _, like elastic_02, found 'P'",
    ),
]


@pytest.mark.parametrize(("change", "line"), LINES)
def test_one_line_for_what_is_wrong(change, line):
    assert problems(Outer, {"name": "a"} | change, "f.yaml") == [f"f.yaml: {line}"]


def test_all_problems_at_once_and_what_is_missing():
    assert problems(Outer, {"kind": 2, "flat": 0}) == [
        "flat: expected a boolean, found 0",
        f"kind: expected one of {', '.join(sorted(Outer.model_fields))}, found kind",
        "name: expected a value, found nothing",
    ]
    with pytest.raises(ValueError, match="^content: expected a mapping, found 3$"):
        Outer.read(3)


def test_what_is_left_out_has_its_default_and_changes_are_checked():
    read = Outer.read({"name": "a", "inner": {"place_m": [2, 3]}, "share": [1, 2]})
    assert read == Outer(name="a", inner=Inner(place_m=(2, 3)), share=(1, 2))
    assert read.written()["inner"] == {"place_m": [2, 3], "rule": "one", "low": 0, "high": 1}
    assert read.changed(count=4).count == 4
    with pytest.raises(ValueError, match="^count: expected a number >= 1, found 0$"):
        read.changed(count=0)


def test_a_whole_number_may_be_written_with_a_point_where_an_integer_is_asked_for():
    read = Outer.read({"name": "a", "count": 640.0, "edge_m": 2.0, "counts": [3.0, 4]})
    assert read.written() | {"count": 640, "edge_m": 2.0} == read.written()
    assert [type(one) for one in (read.count, read.edge_m, *read.counts)] == [int, float, int, int]
    plain = Outer.plain({"points": {"p": {"low": 1.0}}, "count": 640.0, "edge_m": 2})
    assert repr(plain) == "{'points': {'p': {'low': 1.0}}, 'count': 640, 'edge_m': 2}"


class Fixed(Model):
    """A block with a constant."""

    share: float = constant(0.5, "of the whole")
    pair: tuple[float, float] = constant((0.0, 1.0), "of it")
    free: int = 3


def test_code_may_change_a_constant_and_files_may_not():
    assert Fixed(share=0.2).changed(share=0.3, free=4).share == 0.3
    assert Fixed.read({"share": 0.5, "pair": [0, 1]}) == Fixed()
    with pytest.raises(ValueError, match=r"^f.yaml: share: expected 0.5, .* fixed, found 0.2$"):
        Fixed.read({"share": 0.2}, "f.yaml")
    with pytest.raises(ValueError, match=r"^other: expected one of free, found other$"):
        Fixed.read({"other": 1})


def test_a_call_with_wrong_values_is_one_line_for_each():
    with pytest.raises(ValueError) as caught:
        Outer(name="a", count=0, sharp=1)
    assert str(caught.value).splitlines()[0] == "count: expected a number >= 1, found 0"
    assert str(caught.value).count("\n") == 1 and "pydantic" not in str(caught.value)


LEFT_OUT = object()
COVARIANCE = [[4e-10, 1e-10, 0], [1e-10, 4e-10, 0], [0, 0, 9e-10]]
CHARUCO = {"kind": "charuco", "squares": [7, 5], "dictionary": "4X4_50"}
CHARUCO |= {"square_m": 0.015, "tag_m": 0.011}
GRID = {"kind": "aprilgrid", "tags": [4, 3], "tag_m": 0.02, "gap_m": 0.006}
GRID |= {"dictionary": "APRILTAG_36H11"}
CURVES = {"poisson_ratio": 0.45}


def changed(spec, field, value):
    """A file's content with the value of a field, by its place, another or left out."""
    spec = copy.deepcopy(spec)
    *way, last = [int(key) if key.isdigit() else key for key in field.split(".")]
    block = spec
    for key in way:
        block = block[key]
    block[last] = value
    if value is LEFT_OUT:
        del block[last]
    return spec


SENSORS = [
    ("kinect", "color.fx_px", "abc", "expected a number, found 'abc'"),
    ("kinect", "color.fx_px", -1, "expected a number >= 10, found -1"),
    ("kinect", "color.fx_px", float("inf"), "expected a finite number, found inf"),
    ("kinect", "color.distortion.1", float("nan"), "expected a finite number, found nan"),
    ("kinect", "range_m", LEFT_OUT, "expected a value, found nothing"),
    ("kinect", "range_m", [2, 1], "expected increasing distances, found 2, 1"),
    ("kinect", "kind", "sonar", "expected one of cloud, depth, stereo, structured_light, found"
        " 'sonar'"),
    ("kinect", "depth.baseline_m", LEFT_OUT, "expected a value, found nothing"),
    ("kinect", "depth.disparity_scale", 0.0, "expected another number than 0, found 0.0"),
    ("kinect", "depth.count_m", 1e-4, "expected none with encoding kinect_disparity, found 0.0001"),
    ("kinect", "depth", LEFT_OUT, "expected a value, found nothing"),
    ("kinect", "depth", None, "expected a mapping, found None"),
    ("kinect", "color.cx_px", -3, "expected within the image, 0 to 640, found -3"),
    ("kinect", "depth.cy_px", 9e3, "expected within the image, 0 to 480, found 9000"),
    ("bumblebee", "stereo", LEFT_OUT, "expected a value, found nothing"),
    ("bumblebee", "stereo.window_px", 10, "expected an odd number, found 10"),
    ("bumblebee", "color.distortion", [-0.3, 0.1, 0, 0, 0], "expected zeros (rectified), found"
        " [-0.3, 0.1, 0, 0, 0]"),
]  # fmt: skip
PROBES = [
    ("compliance_std_m_n", -1e-6, "expected a number > 0, found -1e-06"),
    ("load", "weighed", "expected a mapping or calibration, found 'weighed'"),
    ("load.mass_kg", 0, "expected a number > 0, found 0"),
    ("stiffness_n_m", [1], "expected a number or calibration, found [1]"),
    ("stiffness_n_m", -1, "expected a number > 0 or calibration, found -1"),
    ("axes_std_rad", "1 deg", "expected a number, found '1 deg'"),
    ("tip_std_m", 1e-5, "expected one of axes, axes_std_rad, compliance_std_m_n, exclusion, "
        "force_from_tip, gauge, indenter, load, marker, marker_from_force, probe, stiffness_n_m, "
        "tip, tip_covariance_m2, tracked, found tip_std_m"),
    ("tip_covariance_m2", [*COVARIANCE[:2], [0, 0, -1e-9]],
        "expected variances above 0 in all directions, found -1e-09"),
    ("tip_covariance_m2", [COVARIANCE[0], [2e-10, 4e-10, 0], COVARIANCE[2]],
        "expected a symmetric matrix, found 1e-10 and 2e-10 on two sides of its diagonal"),
    ("tip_covariance_m2", np.eye(3).tolist(),
        "expected deviations up to 0.02 m, found 1 m (square metres?)"),
    ("gauge.calibration.4", [0.0] * 6, "gauge.calibration: expected six independent rows, found 5"),
    ("marker_from_force.0.3", 30.0,
        "marker_from_force: expected a rotation and a shift, found a shift of 30 m (metres?)"),
    ("exclusion.stem_m", 0.03, None),
    ("exclusion.stem_m", 0.001,
        "expected tip_radius_m 0.0085 to the sensor's place 0.06, found 0.001"),
    ("indenter.radius_m", 0.000622,
        "indenter.radius_m: expected 0.00325 to 0.0085, by exclusion.tip_radius_m (one is wrong),"
        " found 0.000622"),
    ("marker", CHARUCO, None),
    ("marker", GRID, None),
    ("marker.inner_corners", [4, 4], "expected one odd and one even, found 4, 4"),
    ("marker.tag_m", 0.01, "expected none with kind checkerboard, found 0.01"),
    ("marker", CHARUCO | {"tag_m": 0.0145}, "marker.tag_m: expected margins of 0.7 of a tag's cell"
        " on all sides of it in square_m (0.015), found 0.0145"),
    ("marker", CHARUCO | {"squares": [3, 3]},
        "marker.squares: expected 6 inner corners or more, found 3 x 3 squares"),
    ("marker", GRID | {"gap_m": 0.001}, "marker.gap_m: expected 0.1 of tag_m or more, found 0.001"),
    ("marker", GRID | {"tags": [6, 6], "dictionary": "APRILTAG_25H9"},
        "marker.dictionary: expected 36 tags or more, found 35"),
]  # fmt: skip
OBJECTS = [
    ("object", "foam\n", "expected a name of letters, digits and _, like red_sponge, found"
        " 'foam\\n'"),
    ("provenance", None, "expected one of recorded, simulated, found None"),
    ("template", {"unit": "m", "vertices": 800, "scans": "scans"},
        "expected file, or scans and spacing_m, found scans, unit, vertices"),
    ("support.plane_normal", [0, 0, 0], "expected a direction, found zeros"),
    ("mirrors", [[1e300, 0, 0]], "mirrors.0: expected a direction, found [1e+300, 0.0, 0.0]"),
    ("points", {"background": {"position_m": [0, 0, 0]}}, "points.background: expected another name"
        " than that of the empty scene's folder, found background"),
    ("points", {1: {"position_m": [0, 0, 0]}}, "points.1: expected a key in quotes, found the"
        " bare 1"),
    ("curves", CURVES | {"poisson_ratio": [0.4, 0.3]},
        "curves.poisson_ratio: expected the lower before the higher, found [0.4, 0.3]"),
    ("curves", CURVES | {"poisson_ratio": [0.4, 0.6]},
        "curves.poisson_ratio.1: expected a number <= 0.4999, found 0.6"),
    ("curves", CURVES | {"poisson_ratio": "none"},
        "curves.poisson_ratio: expected a number or a list, found 'none'"),
    ("curves", CURVES | {"radius_m": 0.005},
        "curves.radius_m: expected none beside a probe, which has its own, found one"),
]  # fmt: skip


def require_line(kind, spec, field, line):
    """Compare what is said of a file with one line, which begins with the field if not another."""
    whole = line and (line if not line.startswith("expected ") else f"{field}: {line}")
    assert problems(kind, spec, "a.yaml") == ([f"a.yaml: {whole}"] if line else [])


@pytest.mark.parametrize(("name", "field", "value", "line"), SENSORS)
def test_sensors(sensors, name, field, value, line):
    require_line(SensorSpec, changed(sensors[name], field, value), field, line)


@pytest.mark.parametrize(("field", "value", "line"), PROBES)
def test_probes(probe, field, value, line):
    require_line(ProbeSpec, changed(probe, field, value), field, line)


@pytest.mark.parametrize(("field", "value", "line"), OBJECTS)
def test_objects(root, field, value, line):
    spec = load_yaml(root / "tests/own_object/raw/toy_cow/object.yaml")
    require_line(ObjectSpec, changed(spec, field, value), field, line)


@pytest.mark.parametrize(
    ("field", "value", "line"),
    [
        ("objects.ear.material.poisson_ratio", 0.5, "expected a number < 0.5, found 0.5"),
        ("objects.ear.motion.rest_s", LEFT_OUT, "expected a value, found nothing"),
        ("objects.ear.shape.size_m", [1, 1, 1], "expected none with kind ear, found [1, 1, 1]"),
        ("objects.sensors", LEFT_OUT, "expected a name of letters, digits and _ other than sensors"
            " and simulations, like red_sponge, found sensors"),
        ("experiments.pivot.sensors", ["kinect"] * 2,
            "expected no two alike, found kinect again"),
    ],
)  # fmt: skip
def test_labs(root, field, value, line):
    lab = load_yaml(root / "config/lab.yaml")
    lab["objects"] |= {"sensors": lab["objects"]["ear"]} if field == "objects.sensors" else {}
    require_line(Lab, lab if value is LEFT_OUT and "sensors" in field else changed(
        lab, field, value), field, line)  # fmt: skip


@pytest.mark.parametrize(
    ("block", "field"),
    [
        ({"encoding": "counts"}, "depth.count_m"),
        ({"encoding": "millimetre", "count_m": 1e-4}, "depth.count_m"),
        ({"encoding": "counts", "count_m": 1e-4}, None),
        ({"encoding": "kinect_disparity", "baseline_m": 0.075, "disparity_scale": -0.125,
          "disparity_offset_px": 100, "no_reading": 2047}, "depth.encoding"),
    ],
)  # fmt: skip
def test_encodings_of_a_depth_camera(root, block, field):
    spec = load_yaml(root / "tests/own_object/sensors/bench_cam.yaml")
    lines = problems(SensorSpec, spec | {"depth": spec["depth"] | block})
    assert [line.partition(":")[0] for line in lines] == [field] * bool(field)


@pytest.mark.parametrize(
    ("field", "deviation", "value", "part"),
    [
        ("axes", "axes_std_rad", 1e-6, "load"),
        ("stiffness_n_m", "compliance_std_m_n", 1e-6, "stiffness"),
        ("tip", "tip_covariance_m2", COVARIANCE, "tip"),
    ],
)
def test_a_deviation_of_what_is_asked_for(probe, field, deviation, value, part):
    asks = probe | {field: "calibration"}
    assert problems(ProbeSpec, asks) == []
    expected = f"expected none beside {field}: calibration ({part}.json has it), found one"
    assert problems(ProbeSpec, asks | {deviation: value}) == [f"{deviation}: {expected}"]


def test_the_projects_own_are_right_and_named_as_their_files(root, probe, tmp_path):
    for kind, model in MODELS.items():
        for path in (root / "config" / kind).glob("*.yaml"):
            assert read_device(path, kind) == (load_yaml(path), ())
            assert model.read(load_yaml(path))
    known = {"axes_std_rad": 0.001, "compliance_std_m_n": 2e-6, "tip_covariance_m2": COVARIANCE}
    known |= {"load": probe["load"] | {"mass_std_kg": 4e-5}}
    path = tmp_path / "other.yaml"
    path.write_text(yaml.safe_dump(probe | known))
    line = f"{path}: probe: expected other, found nano25_sphere"
    assert read_device(path, "probes") == (probe | known, (line,))


FILES = [
    (SensorSpec, "config/sensors/kinect.yaml", ("color", "width_px")),
    (SensorSpec, "config/sensors/bumblebee.yaml", ("stereo", "window_px")),
    (ProbeSpec, "config/probes/nano25_sphere.yaml", ("marker", "inner_corners", 1)),
    (ObjectSpec, "tests/own_object/raw/toy_cow/object.yaml", ("template", "vertices")),
    (Lab, "config/lab.yaml", ("objects", "ear", "motion", "frames")),
    (Ranges, "config/validation.yaml", ("objects",)),
]


def each_number(value, change, place=()):
    """A file's content with all its numbers changed, given their places."""
    if isinstance(value, dict):
        return {key: each_number(one, change, (*place, key)) for key, one in value.items()}
    if isinstance(value, list):
        return [each_number(one, change, (*place, k)) for k, one in enumerate(value)]
    return value if isinstance(value, bool | str | None) else change(value, place)


@pytest.mark.parametrize(("kind", "path", "integer"), FILES)
def test_integers_may_be_written_with_a_point(root, kind, path, integer):
    spec = load_yaml(root / path)
    pointed = each_number(spec, lambda number, place: float(number))
    assert problems(kind, pointed) == []
    plain = kind.plain(pointed)
    assert plain == spec
    assert type(reduce(getitem, integer, plain)) is int


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(("kind", "path", "integer"), FILES)
def test_what_is_no_number_is_told_once_of_each_field(root, kind, path, integer, number):
    places = []
    spec = each_number(load_yaml(root / path), lambda _, place: places.append(place) or number)
    # The options of an estimate, which the configuration checks.
    places = {".".join(map(str, place)) for place in places if place[0] != "direct"}
    lines = dict(line.split(": expected ") for line in problems(kind, spec))
    assert set(lines) == places
    assert all(f"found {number}" in said for said in lines.values())
    assert all(said.startswith(("a finite number", "an integer")) for said in lines.values())


def test_families_are_opencvs():
    """Their names, how many tags each has, and the cells along one."""
    known = {name[5:] for name in dir(cv2.aruco) if name.startswith("DICT_") and name.isupper()}
    assert set(FAMILIES) == known
    for name, (count, cells) in FAMILIES.items():
        family = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))
        assert (count, cells) == (len(family.bytesList), family.markerSize + 2)
