"""Look-up of one point of an object: force and surface over depth, Poisson's ratio and law."""

import numpy as np
from palpate.capture.files import whole_file
from palpate.run.declared import read_declared
from palpate.run.job import naming, run
from palpate.solid.indentation import load_indentation, mirrored, save_indentation
from palpate.solid.indentation_table import indentation_model
from palpate.solid.mesh import read_solid
from palpate.solid.mirror import Mirror, require_image
from palpate.solid.options import IndentationTable
from palpate.solid.press_setup import PressOptions
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.template import read_template

# How far a mirrored template may be from itself: scans and their meshes agree to about that [m].
IMAGE_TOLERANCE_M = 0.001
# Steps of a shallow look-up are finer than configured.
FEWEST_STEPS = 6


def main(snakemake):
    """Write the look-up."""
    inputs = snakemake.input
    spec, support = read_declared(inputs.object)
    template = read_template(inputs.template, unit=spec["template"]["unit"])
    if inputs.image:
        with naming(inputs.object, "mirrors"):
            model = image_model(inputs.image, support, template, snakemake.params.mirrors)
    else:
        model = pressed_model(snakemake, spec, support, template)
    with whole_file(snakemake.output.model) as part:
        save_indentation(part, model)


def image_model(path, support, template, normals):
    """Look-up of a mirror image of another point, in an object that is its own image."""
    model = load_indentation(path)
    for normal in normals:
        unit = np.array(normal, float) / np.linalg.norm(normal)
        mirror = Mirror(support.plane_point_m, unit)
        require_image(mirror, template.vertices_m, template.faces, tolerance_m=IMAGE_TOLERANCE_M)
        model = mirrored(model, mirror.point_m, mirror.normal)
    return model


def pressed_model(snakemake, spec, support, template):
    """Press the object at the declared point."""
    inputs, options = snakemake.input, IndentationTable.read(snakemake.params.options)
    mesh = read_solid(inputs.solid)
    point = declared_point(inputs.object, spec, snakemake.wildcards.point)
    # Hertz's contact radius goes with the root of the depth, and so do the elements under it.
    deepest = spec.get("deepest_m", options.deepest_m)
    with naming(inputs.object):
        return indentation_model(
            mesh,
            support,
            np.array(point["position_m"], dtype=float),
            np.array(point.get("direction", -support.plane_normal), dtype=float),
            radius_m=snakemake.params.probe["indenter"]["radius_m"],
            deepest_m=deepest,
            surface=SmoothSurface(template.vertices_m, template.faces),
            laws=options.laws,
            poisson_ratios=options.poisson_ratios,
            step_m=min(options.step_m, deepest / FEWEST_STEPS),
            options=PressOptions(
                edge_m=options.edge_m * min(1.0, (deepest / options.deepest_m) ** 0.5),
                growth=options.growth,
                refine_radius_m=options.refine_radius_m,
            ),
        )


def declared_point(path, spec, name):
    """Return what object.yaml says of a point."""
    if name not in spec["points"]:
        names = ", ".join(sorted(spec["points"]))
        raise ValueError(f"{path}: points: expected one of {names}, found {name}")
    return spec["points"][name]


run(main, snakemake)
