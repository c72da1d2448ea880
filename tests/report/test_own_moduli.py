"""Moduli of one object, capture by capture and together, as lines that fill their figure."""

import pytest
from matplotlib import pyplot as plt
from palpate.report.own_moduli import HIGHEST_IN, own_moduli
from palpate.report.style import journal


def found(star_pa, verdict="identified"):
    return {
        name: {"value": value, "low": 0.9 * value, "high": 1.2 * value, "verdict": verdict}
        for name, value in (
            ("effective_reduced_modulus_pa", star_pa),
            ("youngs_modulus_pa", 0.9 * star_pa),
            ("poisson_ratio", 0.3),
        )
    }


@pytest.fixture
def draw():
    def drawn(counts):
        """Figure of so many captures with each sensor."""
        captures = [
            {"sensor": sensor, "capture": f"{k + 1:02d}"}
            for sensor, count in counts.items()
            for k in range(count)
        ]
        singles = [found(1e3 * (10 + k), "bounded") for k in range(len(captures))]
        return own_moduli(captures, singles, list(counts), [found(9e3)] * len(counts))

    with journal():
        yield drawn
    plt.close("all")


def labels(figure):
    return [label.get_text() for label in figure.axes[0].get_yticklabels()]


def test_captures_stand_above_what_they_say_together(draw):
    figure = draw({"kinect": 2, "my_cam": 1})
    assert labels(figure) == ["Kinect 01", "Kinect 02", "Kinect, all 2", "my_cam"]
    star, _, nu = figure.axes
    low, high = star.lines[0].get_xdata()
    assert (low, high) == pytest.approx((9.0, 12.0)) and list(star.lines[0].get_ydata()) == [0, 0]
    assert star.lines[1].get_xdata()[0] == pytest.approx(10.0)
    hollow = [line.get_markerfacecolor() == "white" for line in star.lines[1::2]]
    assert hollow == [True, True, False, False]
    assert nu.get_xlim() == (0, 0.5) and star.get_xlim()[0] == 0


def test_one_capture_is_one_line_and_the_figure_is_no_higher_than_its_lines(draw):
    one, several, many = (draw({"kinect": count}) for count in (1, 6, 60))
    assert labels(one) == ["Kinect"]
    assert one.get_figheight() < 1.0 < several.get_figheight() < 2.5
    assert many.get_figheight() == HIGHEST_IN
    for figure in (one, several):
        lowest, highest = figure.axes[0].get_ylim()
        assert lowest - highest < len(labels(figure)) + 0.5
