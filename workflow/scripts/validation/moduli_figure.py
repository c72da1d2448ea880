"""Figures of E and nu beside the true ones, and of the tool in one picture."""

from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from palpate.json_fields import read_all, read_by_folder
from palpate.report.moduli_figure import SCALES, TRUTH, Line, draw_lines, make_moduli
from palpate.report.panels import photo_panel
from palpate.report.style import PAGE_IN, finished, sensor_name
from palpate.report.surface_figures import read_view, section_panel
from validation.measured import truth_of

SHOWN = ("youngs_modulus_pa", "poisson_ratio")


def make_direct_moduli(inputs: Any, params: Any) -> Figure:
    """Moduli of captures and groups, beside the true ones where there are any."""
    truths = {name: truth_of(one) for name, one in read_by_folder(inputs.materials).items()}
    return make_moduli(inputs, params, truths)


def make_overview(inputs: Any, params: Any) -> Figure:
    """Photograph of a capture, section through the dent, and moduli of its object by sensor."""
    (capture,), (fit,) = params.captures, read_all(inputs.fits)
    files = inputs.tracked[0], inputs.clouds[0], fit, inputs.recorded[0]
    view = read_view(*files, params.sensors[0])
    figure = plt.figure(figsize=(PAGE_IN, 2.3))
    grid = figure.add_gridspec(2, 3, width_ratios=(1.3, 1.5, 1))
    photo, section = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[:, 1])
    photo_panel(photo, view.photo)
    photo.set_title("An indentation", y=1.02)
    section_panel(section, view)
    section.set(title="Section through it", xlabel="From the contact (mm)")
    section.legend(loc="lower center", fontsize=6, handlelength=1.4, ncols=3, columnspacing=1)
    found = zip(params.groups, read_all(inputs.joint), strict=True)
    lines = [Line(sensor_name(group["sensor"]), joint, True) for group, joint in found]
    truth = truth_of(read_by_folder(inputs.materials)[capture["object"]])
    panels = [figure.add_subplot(grid[row, 2]) for row in range(2)]
    for panel, quantity in zip(panels, SHOWN, strict=True):
        draw_lines(panel, lines, quantity)
        panel.axvline(truth[quantity] * SCALES[quantity], **TRUTH)
    panels[0].set_title("Moduli")
    return finished(figure, {capture["provenance"]})
