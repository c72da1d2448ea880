"""Look-up of one point of an object: force and surface over depth, Poisson's ratio and law."""

import numpy as np
from job import naming, run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.solid.indentation import save_indentation
from palpate.solid.indentation_table import indentation_model
from palpate.solid.mesh import read_solid
from palpate.solid.press_setup import PressOptions
from palpate.solid.sizing import Support
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.template import read_template

FINENESS = ("edge_m", "growth", "refine_radius_m")


def main(snakemake):
    """Write the look-up."""
    inputs, options = snakemake.input, snakemake.params.options
    spec, mesh = load_yaml(inputs.object), read_solid(inputs.solid)
    template = read_template(inputs.template, unit=spec["template"]["unit"])
    support, point = spec["support"], declared_point(inputs.object, spec, snakemake.wildcards.point)
    normal = np.array(support["plane_normal"], dtype=float)
    with naming(inputs.object):
        model = indentation_model(
            mesh,
            Support(np.array(support["plane_point_m"], float), normal, support["tolerance_m"]),
            np.array(point["position_m"], dtype=float),
            np.array(point.get("direction", -normal), dtype=float),
            radius_m=snakemake.params.probe["indenter"]["radius_m"],
            deepest_m=options["deepest_m"],
            contact=support.get("contact", "bonded"),
            surface=SmoothSurface(template.vertices_m, template.faces),
            laws=tuple(options["laws"]),
            poisson_ratios=tuple(options["poisson_ratios"]),
            step_m=options["step_m"],
            options=PressOptions(**{name: options[name] for name in FINENESS}),
        )
    with whole_file(snakemake.output.model) as part:
        save_indentation(part, model)


def declared_point(path, spec, name):
    """Return what object.yaml says of a point."""
    if name not in spec["points"]:
        names = ", ".join(sorted(spec["points"]))
        raise ValueError(f"{path}: points: expected one of {names}, found {name}")
    return spec["points"][name]


run(main, snakemake)
