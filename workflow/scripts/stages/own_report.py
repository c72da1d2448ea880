"""Page of one object, in one file for a browser."""

import logging
from pathlib import Path

import numpy as np
import pandas as pd
from palpate.capture.files import write_text
from palpate.capture.images import Stream
from palpate.capture.tables import columns_of, read_table
from palpate.estimate.direct.motion import load_motion
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.result import load_fitted
from palpate.json_fields import read_all, read_by_folder
from palpate.plan import as_recorded, narrowed
from palpate.report.estimate_rows import compared
from palpate.report.held import Held
from palpate.report.own_figures import MAPPED, OWN_FIGURES
from palpate.report.own_page import own_page
from palpate.report.point_maps import map_picture, point_maps
from palpate.report.press_pictures import Frames, glimpses
from palpate.report.settings_words import as_yaml, checksums, rests_on
from palpate.report.style import capture_name
from palpate.report.viewer import map_view, view
from palpate.solid.indentation_table import load_indentation
from palpate.surface.alignment import load_alignment
from palpate.surface.tracked import load_tracked
from palpate.vision.camera import camera_from_spec, with_calibration
from palpate.vision.clouds import read_clouds
from palpate.vision.foreground import load_masks
from palpate.vision.probe import AXIS, TIP
from palpate.workflow.job import naming, run
from palpate.workflow.object_inputs import read_declared, read_object


def main(snakemake):
    """Write the page."""
    inputs, params = snakemake.input, snakemake.params
    estimated = zip(params.groups, map(load_fitted, inputs.fitted), strict=True)
    fits = {group["sensor"]: fitted for group, fitted in estimated}
    mine = [fits[one["sensor"]][one["capture"]] for one in params.captures]
    found = read_all(inputs.fits), read_all(inputs.direct), map(read_table, inputs.poses)
    fitted = [one.tip_depth_m for one in mine], [one.frames for one in mine]
    held = [Held(*of_one) for of_one in zip(params.captures, *found, *fitted, strict=True)]
    known = {capture_name(one.capture): one for one in held}
    firsts = [known[capture_name(capture)] for capture in params.first]
    direct = [one.direct for one in held]
    joints = compared(params.captures, direct, params.groups, read_all(inputs.joint))[1]
    spec, _ = read_declared(inputs.object)
    files = {"object": spec, "probe": params.probe, "direct.fit": params.options}
    summary = pd.read_csv(inputs.summary, dtype={"capture": str, "point": str})
    tables = dict(zip(params.points, map(load_indentation, inputs.tables), strict=True))
    places = {point: table.point_m for point, table in tables.items()}
    maps = point_maps(params.captures, direct, params.groups, places)
    pictures = {one.name: Path(inputs[one.name]).read_bytes() for one in OWN_FIGURES}
    with naming(inputs.summary):
        text = own_page(
            snakemake.wildcards.object,
            summary,
            held,
            pictures=pictures | picture_of_maps(inputs, maps, params.captures),
            glimpses=list(pictures_of(inputs, params.sensors, firsts)),
            joints={g["sensor"]: one for g, one in zip(params.groups, joints, strict=True)},
            settings=settings_of(inputs, params, spec, held, tables),
            checksums=checksums(files_of(inputs, params)),
            files={name: as_yaml(content) for name, content in files.items()},
            views=list(views_of(inputs.tracked, firsts, fits, maps)),
            narrowed=dict(narrowed_of(inputs, params, tables)),
            maps=maps,
        )
    write_text(snakemake.output.page, text)


def settings_of(inputs, params, spec, held, tables):
    """What the estimates were made with, as rows."""
    (quality,) = read_all([inputs.quality])
    return rests_on(spec, params.probe, quality, params.sensors, held, tables, params.version)


def files_of(inputs, params):
    """Files and folders whose checksums are on the page, by what they are called there."""
    captures = {
        capture_name(one): path for one, path in zip(params.captures, inputs.folders, strict=True)
    }
    joints = zip(params.groups, inputs.joint, strict=True)
    estimates = {f"direct.json of {group['sensor']}": path for group, path in joints}
    found = {Path(inputs[name]).name: inputs[name] for name in ("object", "solid", "summary")}
    return found | estimates | captures


def narrowed_of(inputs, params, tables):
    """By sensor, what would narrow its intervals."""
    _, support, template = read_object(inputs)
    joints = dict(zip((g["sensor"] for g in params.groups), read_all(inputs.joint), strict=True))
    files = inputs.paths, inputs.motions, inputs.alignments
    for capture, sensor, path, motion, pose in zip(
        params.first, params.sensors, *files, strict=True
    ):
        table, found = tables[capture["point"]], joints[capture["sensor"]]
        rig = table, template, support, sensor, params.probe
        known = {"path": read_table(path), "motion": load_motion(motion)}
        known |= {"alignment": load_alignment(pose), "found": found}
        options = {"options": Fit.read(params.options)}
        try:
            yield capture["sensor"], narrowed(*as_recorded(*rig, **known, **options), found)
        except ValueError as error:  # a plan's camera may see less than the recording's
            logging.warning("%s: no forecast of other recordings: %s", capture["sensor"], error)


def views_of(paths, firsts, fits, maps):
    """The surface of the first capture with each sensor, measured and computed; then the maps."""
    mapped, views = {one.sensor: one for one in maps if one.map}, []
    for one, path in zip(firsts, paths, strict=True):
        sensor = one.capture["sensor"]
        with naming(path):
            tracked = load_tracked(path)
            yield view(one.capture, tracked, one.fit, fits[sensor][one.capture["capture"]])
        views += [map_view(mapped[sensor], tracked)] if sensor in mapped else []
    yield from views


def picture_of_maps(inputs, maps, captures):
    """The picture of those sensors that have a map, if any has."""
    if not (mapped := [one for one in maps if one.map]):
        return {}
    template = read_object(inputs)[2]
    provenances = {capture["provenance"] for capture in captures}
    return {MAPPED: map_picture(mapped, template.vertices_m, template.faces, provenances)}


def pictures_of(inputs, sensors, firsts):
    """Small pictures of the first capture with each sensor."""
    optics = read_by_folder(inputs.optics)
    masks = iter(inputs.masks)
    files = inputs.recorded, inputs.clouds
    for one, sensor, recorded, cloud in zip(firsts, sensors, *files, strict=True):
        if "color" not in sensor:
            continue
        name = one.capture["sensor"]
        sensor = with_calibration(sensor, optics[name]) if name in optics else sensor
        with naming(f"{name}/{one.capture['capture']}/probe_pose.csv"):
            tips, axes = columns_of(one.poses, TIP), columns_of(one.poses, AXIS)
        seen = Stream(recorded, sensor), load_masks(next(masks)), tips, axes, read_clouds(cloud)
        camera, force_n = camera_from_spec(sensor["color"]), np.array(one.fit["samples"]["force_n"])
        frames = Frames(*seen, camera, force_n)
        yield from glimpses(frames, one.deepest, capture_name(one.capture))


run(main, snakemake)
