"""Direct estimates of E and nu with their intervals, beside the true ones."""

from typing import Any

from matplotlib.figure import Figure
from palpate.json_fields import read_all, read_by_folder
from palpate.report.estimate_rows import compared
from palpate.report.moduli_figure import moduli_figure
from validation.measured import truth_of


def make_direct_moduli(inputs: Any, params: Any) -> Figure:
    """Moduli of captures and groups, beside the true ones where there are any."""
    files = read_all(inputs.direct), read_all(inputs.joint)
    singles, joints = compared(params.captures, files[0], params.groups, files[1])
    truths = {name: truth_of(one) for name, one in read_by_folder(inputs.materials).items()}
    return moduli_figure(params.captures, singles, params.groups, joints, truths)
