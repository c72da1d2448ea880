"""What a plan forecasts, beside what estimates of captures with that noise come to."""

from dataclasses import replace

import numpy as np
import pytest
from palpate.__main__ import main
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.options import Fit
from palpate.plan import Noise, Planned, Protocol

E_PA, NU = 2e4, 0.3
FIT = Fit(poisson_ratio_bounds=(0.0, 0.45))


@pytest.fixture(scope="module")
def planned(synthetic, sensors):
    of_object = synthetic.table(), synthetic.template, synthetic.support
    noise = Noise(5e-5, 0.005, 1e-4)
    return Planned(*of_object, sensors["kinect"], synthetic.probe, noise, E_PA, NU, FIT)


@pytest.fixture(scope="module")
def protocol(planned):
    camera_m = planned.table.point_m + [0.0, -0.5, 0.5]
    return Protocol(0.005, 10.0, planned.table.radius_m, camera_m, captures=2)


def test_captures_with_that_noise_come_to_the_widths_that_are_forecast(planned, protocol):
    captures = list(planned.captures(protocol, (1, 2)))
    found = estimate_direct(captures, FIT, radius_m=protocol.radius_m).moduli
    forecast = planned.forecast(protocol)
    for name in ("effective_reduced_modulus_pa", "reduced_modulus_pa", "youngs_modulus_pa"):
        one = found[name]
        assert (one.high - one.low) / 2 / one.value == pytest.approx(
            forecast.half_width[name], rel=1 / 3
        )
    one = found["poisson_ratio"]
    assert (one.high - one.low) / 2 == pytest.approx(
        forecast.half_width["poisson_ratio"], rel=1 / 3
    )
    assert found["youngs_modulus_pa"].low < E_PA < found["youngs_modulus_pa"].high
    assert one.low < NU < one.high


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        ({"captures": 8}, {"captures": 1}),
        ({"depth_m": 0.006}, {"depth_m": 0.003}),
        ({"frame_rate_hz": 30.0}, {"frame_rate_hz": 5.0}),
    ],
)
def test_more_of_it_narrows_the_intervals(planned, protocol, better, worse):
    narrow, wide = (planned.forecast(replace(protocol, **one)) for one in (better, worse))
    for name in ("effective_reduced_modulus_pa", "youngs_modulus_pa", "poisson_ratio"):
        assert narrow.half_width[name] < wide.half_width[name]


def test_what_limits_is_the_noise_that_is_large(planned, protocol):
    noisy = replace(planned, noise=replace(planned.noise, surface_m=1e-3)).forecast(protocol)
    assert noisy.limit["poisson_ratio"] == "noise of the displacement"
    assert noisy.verdict["poisson_ratio"] == "bounded"
    assert planned.forecast(protocol).verdict["poisson_ratio"] == "identified"
    shaky = replace(planned, noise=replace(planned.noise, tip_m=3e-4)).forecast(protocol)
    assert shaky.limit["effective_reduced_modulus_pa"] == "noise of the depth"


def test_a_camera_that_sees_nothing_or_a_depth_beyond_the_table_is_an_error(planned, protocol):
    below = replace(protocol, camera_m=planned.table.point_m - [0, 0, 0.5])
    with pytest.raises(ValueError, match="some that the camera sees, found all hidden"):
        planned.forecast(below)
    with pytest.raises(ValueError, match="up to the table's 6.0 mm, found 7 mm"):
        planned.forecast(replace(protocol, depth_m=0.007))
    # Nothing is hidden of samples that are too far off.
    close = FIT.changed(farthest_m=FIT.nearest_m)
    with pytest.raises(ValueError, match="mm from the contact, off base.*, found none"):
        replace(planned, options=close).forecast(protocol)


def test_a_force_within_its_noise_or_a_frame_or_two_determine_nothing(planned, protocol):
    with pytest.raises(ValueError, match="force"):
        replace(planned, youngs_modulus_pa=100.0).forecast(protocol)
    with pytest.raises(ValueError, match="frame_rate_hz: expected 5 frames in contact or more"):
        planned.forecast(replace(protocol, frame_rate_hz=1.0))


def test_poses_of_a_robot_bring_the_error_of_their_base(planned, protocol):
    robot = {name: value for name, value in planned.sensor.items() if name != "marker"}
    robot |= {"base": {"camera_from_base": np.eye(4).tolist(), "pose_std_m": 5e-5}}
    noise, usual = (Noise.expected(of, planned.probe, 0.7) for of in (robot, planned.sensor))
    assert noise.tip_m == 5e-5 and noise.surface_m == usual.surface_m
    widths = [
        replace(planned, sensor=of).forecast(protocol).half_width["youngs_modulus_pa"]
        for of in (planned.sensor, robot)
    ]
    assert widths[0] < widths[1]


REJECTED = {
    "--modulus-kpa -3": "--modulus-kpa: expected a number above 0, found -3",
    "--modulus-kpa 30 --nu 0.5": "--nu: expected from 0 to below 0.5, found 0.5",
    "--modulus-kpa 30 --captures 0": "--captures: expected a number above 0 and up to 100, found 0",
    "--modulus-kpa 30 --frame-rate-hz 1e4": "--frame-rate-hz: expected a number above 0 and up to",
    "--modulus-kpa 30 --camera-mm 0 0 9 --distance-mm 9": "--distance-mm: expected none beside",
    "--modulus-kpa 30 --depth-mm 500": "--depth-mm: expected up to the",
    "--modulus-kpa 30 --point 99": "--point: expected one of",
    "--modulus-kpa 30 --sensor none": "none.yaml: file: expected a file, found none",
    "--modulus-kpa 30 --figure x.txt": "--figure: expected a file that ends with",
}


@pytest.mark.parametrize("given", list(REJECTED))
def test_what_is_wrong_is_one_line_before_work(root, capsys, given):
    folder = root / "tests/sample/raw/foam_block"
    of_sample = f"plan {folder} --sensors {root}/tests/sample/sensors --sensor kinect {given}"
    assert main(of_sample.split()) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert REJECTED[given] in line


def test_a_text_for_a_number_is_one_line(capsys):
    with pytest.raises(SystemExit, match="2"):
        main("plan raw/sponge --sensor kinect --modulus-kpa soft".split())
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: --modulus-kpa: expected a number, found soft")
