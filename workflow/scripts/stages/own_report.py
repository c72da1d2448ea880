"""Page of one object, in one file for a browser."""

from pathlib import Path

import pandas as pd
from palpate.capture.files import whole_file
from palpate.capture.tables import columns_of, read_table
from palpate.estimate.direct.result import load_fitted
from palpate.json_fields import read_all, read_by_folder
from palpate.report.held import Held
from palpate.report.moduli_table import compared
from palpate.report.other_methods import HERTZ
from palpate.report.own_page import CAPTIONS, own_page
from palpate.report.press_pictures import frames_of, glimpses
from palpate.report.recording_checks import named
from palpate.report.settings_words import checksums, rests_on, told_whole
from palpate.report.table_page import table
from palpate.report.turning_view import view_of
from palpate.solid.indentation_table import load_indentation
from palpate.surface.tracked import load_tracked
from palpate.vision.camera import with_calibration
from palpate.vision.clouds import read_clouds
from palpate.vision.foreground import load_masks
from palpate.vision.probe import AXIS, TIP
from palpate.workflow.job import naming, run
from palpate.workflow.object_inputs import read_declared


def main(snakemake):
    """Write the page."""
    inputs, params = snakemake.input, snakemake.params
    files = read_all(inputs.fits), read_all(inputs.direct), map(read_table, inputs.poses)
    fits = fits_of(inputs, params)
    mine = [fits[one["sensor"]][one["capture"]] for one in params.captures]
    fitted = [one.tip_depth_m for one in mine], [one.frames for one in mine]
    held = [Held(*of_one) for of_one in zip(params.captures, *files, *fitted, strict=True)]
    direct = [one.direct for one in held]
    joints = compared(params.captures, direct, params.groups, read_all(inputs.joint))[1]
    name = snakemake.wildcards.object
    spec, _ = read_declared(inputs.object)
    summary = pd.read_csv(inputs.summary, dtype={"capture": str, "point": str})
    with naming(inputs.summary):
        text = own_page(
            name,
            summary,
            held,
            pictures={one: Path(inputs[one]).read_bytes() for one in (*CAPTIONS, HERTZ)},
            glimpses=list(pictures_of(inputs, params, held)),
            joints={g["sensor"]: found for g, found in zip(params.groups, joints, strict=True)},
            settings=settings_of(inputs, params, spec, held),
            files=told_whole(object=spec, probe=params.probe, direct_estimate=params.options),
            style=Path(inputs.style).read_text(encoding="utf-8"),
            views=views_of(inputs, params, held, fits),
            behaviour=Path(inputs.behaviour).read_text(encoding="utf-8"),
            overview="../objects.html",
        )
    with whole_file(snakemake.output.page) as part:
        part.write_text(text, encoding="utf-8")


def settings_of(inputs, params, spec, held):
    """What the estimates were made with, in Markdown."""
    (quality,) = read_all([inputs.quality])
    captures = {named(one): path for one, path in zip(params.captures, inputs.folders, strict=True)}
    joints = zip(params.groups, inputs.joint, strict=True)
    estimates = {f"direct.json of {group['sensor']}": path for group, path in joints}
    found = {Path(inputs[name]).name: inputs[name] for name in ("object", "solid", "summary")}
    tables = {
        p: load_indentation(path) for p, path in zip(params.points, inputs.tables, strict=True)
    }
    rows = rests_on(spec, params.probe, quality, params.sensors, held, tables, params.version)
    return "\n".join([*table(rows), "", *table(checksums(found | estimates | captures))])


def fits_of(inputs, params):
    """What the estimates from all captures make of each, by sensor and capture."""
    return {
        group["sensor"]: load_fitted(path)
        for group, path in zip(params.groups, inputs.fitted, strict=True)
    }


def views_of(inputs, params, held, fits):
    """The dent of the first capture with each sensor."""
    known = {named(one.capture): one for one in held}
    found = {}
    for capture, path in zip(params.first, inputs.tracked, strict=True):
        fit, forces = fits[capture["sensor"]][capture["capture"]], known[named(capture)].fit
        with naming(path):
            found[named(capture)] = view_of(load_tracked(path), fit, forces["samples"]["force_n"])
    return found


def pictures_of(inputs, params, held):
    """Small pictures of the first capture with each sensor."""
    known = {named(one.capture): one for one in held}
    optics = read_by_folder(inputs.optics)
    files = zip(inputs.recorded, inputs.masks, inputs.clouds, strict=True)
    for capture, sensor, (recorded, mask, cloud) in zip(
        params.first, params.sensors, files, strict=True
    ):
        name, one = capture["sensor"], known[named(capture)]
        with naming(f"{name}/{capture['capture']}/probe_pose.csv"):
            tips, axes = columns_of(one.poses, TIP), columns_of(one.poses, AXIS)
        frames = frames_of(
            recorded,
            with_calibration(sensor, optics[name]) if name in optics else sensor,
            masks=load_masks(mask),
            clouds=read_clouds(cloud),
            tips_m=tips,
            axes=axes,
            force_n=one.fit["samples"]["force_n"],
        )
        yield from glimpses(frames, one.fit["range"]["last_frame"], named(capture))


run(main, snakemake)
