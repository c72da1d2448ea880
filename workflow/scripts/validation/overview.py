"""The tool in one picture: an indentation, its section, E and nu against the truth."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from palpate.json_fields import read_all, read_by_folder
from palpate.report.moduli_figure import SCALES, Line, draw_lines
from palpate.report.panels import photo_panel
from palpate.report.style import BLACK, PAGE_IN, finished, sensor_name
from palpate.report.surface_figures import TrackedView, read_view, section_panel
from validation.measured import truth_of

SHOWN = ("youngs_modulus_pa", "poisson_ratio")


def make_overview(inputs: Any, params: Any) -> Figure:
    """A capture, and the estimate from all captures of its object by each sensor."""
    (capture,) = params.captures
    (fit,) = read_all(inputs.fits)
    view = read_view(
        inputs.tracked[0], inputs.clouds[0], fit, inputs.recorded[0], params.sensors[0]
    )
    truth = truth_of(read_by_folder(inputs.materials)[capture["object"]])
    return overview(capture, view, params.groups, read_all(inputs.joint), truth)


def overview(
    capture: Mapping,
    view: TrackedView,
    groups: Sequence[Mapping],
    joints: Sequence[Mapping],
    truth: Mapping[str, float],
) -> Figure:
    """Photograph, section through the dent, and moduli by sensor.

    Parameters
    ----------
    capture : mapping
        Described capture that is shown.
    view : TrackedView
    groups, joints : sequences of mapping
        ``object, sensor`` and the direct.json of all captures of each.
    truth : mapping
        True moduli, of `truth_of`.
    """
    figure = plt.figure(figsize=(PAGE_IN, 2.3))
    grid = figure.add_gridspec(2, 3, width_ratios=(1.3, 1.5, 1))
    photo, section = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[:, 1])
    photo_panel(photo, view.photo)
    photo.set_title("An indentation", y=1.02)
    section_panel(section, view)
    section.set_title("Section through it")
    section.set_xlabel("From the contact (mm)")
    section.legend(loc="lower center", fontsize=6, handlelength=1.4, ncols=3, columnspacing=1)
    found = zip(groups, joints, strict=True)
    lines = [Line(sensor_name(group["sensor"]), joint, True) for group, joint in found]
    for row, quantity in enumerate(SHOWN):
        panel = figure.add_subplot(grid[row, 2])
        draw_lines(panel, lines, quantity)
        panel.axvline(truth[quantity] * SCALES[quantity], color=BLACK, lw=0.8, ls="--", zorder=0)
        if row == 0:
            panel.set_title("Moduli")
    return finished(figure, {capture["provenance"]})
