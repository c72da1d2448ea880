"""Hertz fit of one capture."""

import json
from dataclasses import asdict

import numpy as np
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_table
from palpate.estimate.hertz.fit import RESIDUALS, fit_free_contact, fit_study
from palpate.estimate.hertz.laws import contact_law
from palpate.estimate.hertz.mixture import Beliefs
from palpate.estimate.hertz.models import Press, fit_held, fit_models, recommended
from palpate.estimate.hertz.range import (
    check_contact,
    hertz_range,
    indentation_depth,
)
from palpate.estimate.hertz.record import held_record
from palpate.run.job import naming, run
from palpate.surface.alignment import load_alignment, thickness_along
from palpate.surface.checks import columns_of
from palpate.surface.template import read_template
from palpate.vision.force import FORCE
from palpate.vision.probe import ALONG_STD, TIP


def main(snakemake):
    """Write hertz.json."""
    options = snakemake.params.options
    press, record, chosen, samples = read_press(snakemake)
    with naming(snakemake.input.force):
        models = fitted_press(press, record, options)
    frames = {"first_frame": chosen.start, "last_frame": chosen.stop}
    result = {"range": frames, "samples": samples} | models
    with whole_file(snakemake.output.fit) as part:
        part.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


def fitted_press(press, record, options):
    """Fit every model to the samples of a press, and the recommended one to its hold too."""
    law = contact_law(
        "parabola", "half_space", radius_m=press.radius_m, thickness_m=press.thickness_m, nu=0.0
    )
    fitted = {"baseline": options["baseline"], "residual": options["residual"]}
    models = fit_models(
        press, nu=options["assumed_poisson_ratio"], series=options["layer_series"], **fitted
    )
    relaxation = {"verdict": "too few samples"}
    if record is not None:
        rows, relaxation = held_press(press, record, models, options)
        models += rows
    used = slice(press.onset, None)
    depth, force = press.depth_m[used], press.force_n[used]
    return {
        "radius_m": press.radius_m,
        "thickness_m": press.thickness_m,
        "depth_std_m": press.depth_std_m,
        "depth_over_radius": press.depth_over_radius,
        "chi": press.chi,
        "study": asdict(fit_study(depth, force, press.radius_m)),
        "free_contact": asdict(fit_free_contact(press.depth_m, press.force_n, law, **fitted)),
        "residuals": by_residual(depth, force, law),
        "assumed_poisson_ratio": options["assumed_poisson_ratio"],
        "layer_series": options["layer_series"],
        "models": models,
        "relaxation": relaxation,
        "recommended": recommended(press, models),
    }


def held_press(press, record, models, options):
    """Fit the recommended model with relaxation."""
    return fit_held(
        press,
        record,
        recommended(press, models),
        nu=options["assumed_poisson_ratio"],
        series=options["layer_series"],
        beliefs=Beliefs(**options["relaxation"]),
    )


def read_press(snakemake):
    """Read the press, the same with its hold, its range and all samples."""
    inputs, radius = snakemake.input, snakemake.params.probe["indenter"]["radius_m"]
    poses = read_table(inputs.pose)
    with naming(inputs.force):
        table = read_table(inputs.force)
        forces, time = columns_of(table, FORCE), columns_of(table, ["time_s"])[:, 0]
        force = np.linalg.norm(forces, axis=1)
    with naming(inputs.pose):
        tips = columns_of(poses, TIP, frames=len(force))
    unit = load_yaml(inputs.object)["template"]["unit"]
    template = read_template(inputs.template, unit=unit)
    alignment = load_alignment(inputs.alignment)
    depth = indentation_depth(template, alignment, tips, radius_m=radius)
    with naming(inputs.force):
        chosen = hertz_range(force, onset_force_n=snakemake.params.options["onset_force_n"])
    with naming(inputs.pose):
        check_contact(depth, chosen.start)
    own = float(np.nanmedian(poses[ALONG_STD]))
    std = float(np.hypot(own, alignment.residual.contact_mean_m))
    of_depth = {"frame_std_m": own, "contact_std_m": std}
    with naming(inputs.template):
        thickness = pressed_thickness(template, alignment, tips, chosen)
    press = Press(
        depth_m=depth[: chosen.stop + 1],
        force_n=force[: chosen.stop + 1],
        onset=chosen.start,
        radius_m=radius,
        thickness_m=thickness,
        depth_std_m=std,
    )
    record = held_record(time, depth, forces, chosen, **of_depth)
    return press, record, chosen, {"depth_m": depth.tolist(), "force_n": force.tolist()}


def pressed_thickness(template, alignment, tips_m, chosen):
    """Thickness of the object along the way of the tip from its touch to its deepest place [m]."""
    moved = tips_m[chosen.stop] - tips_m[chosen.start - 1]
    direction = alignment.camera_from_object[:3, :3].T @ moved
    return thickness_along(template, alignment.contact_point_m, direction)


def by_residual(depth, force, law):
    """Fit the samples in range with each choice of what is compared; it alone can move E*."""
    if len(force) <= 2:
        return {}
    return {name: asdict(fit_free_contact(depth, force, law, residual=name)) for name in RESIDUALS}


run(main, snakemake)
