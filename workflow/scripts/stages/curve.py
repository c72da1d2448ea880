"""E* and E of one curve of force and position, without a camera."""

from dataclasses import asdict

from palpate.capture.check import declared_curve, poisson_ratios
from palpate.capture.files import write_json
from palpate.estimate.curve import estimate_curve
from palpate.estimate.direct.options import Fit
from palpate.estimate.hertz.curve_fit import fit_curve
from palpate.estimate.hertz.curve_setup import curve_setup
from palpate.solid.indentation_table import load_indentation
from palpate.workflow.job import naming, run
from palpate.workflow.object_inputs import read_declared


def main(snakemake):
    """Write curve.json."""
    inputs, params = snakemake.input, snakemake.params
    spec, _ = read_declared(inputs.object)
    curve = declared_curve(inputs.curve, spec, params.probe)
    ratios = poisson_ratios(spec)
    setup = curve_setup(spec, params.probe)
    with naming(inputs.curve, "force", "contact", "samples"):
        hertz = fit_curve(*curve.loading(), setup)
    with (
        naming(inputs.curve, "samples"),
        naming(inputs.object, "deepest_m", "curves"),
        naming(inputs.table, "table"),
    ):
        options = Fit.read(params.options)
        found = estimate_curve(hertz, load_indentation(inputs.table), ratios, options)
    samples = {"depth_m": hertz.depth_m, "force_n": hertz.force_n, "fitted_n": found.fitted_n}
    fields = {key: value for key, value in vars(found).items() if key not in ("moduli", "fitted_n")}
    fields |= {
        "moduli": {name: asdict(one) for name, one in found.moduli.items()},
        "read": curve.read,
        "warnings": [*curve.warnings, *hertz.warnings, *found.warnings],
        "hertz": hertz.row(),
        "samples": {name: values.tolist() for name, values in samples.items()},
    }
    write_json(snakemake.output.estimate, fields)


run(main, snakemake)
