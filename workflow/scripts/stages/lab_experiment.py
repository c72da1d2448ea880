"""Record an experiment about a sensor or the probe that it films."""

import numpy as np
from palpate.capture.files import whole_file, whole_folder
from palpate.workflow.job import run
from virtual_lab.calibration import record_calibration
from virtual_lab.device import device_of
from virtual_lab.experiments import record_planes, record_trace, record_workspace
from virtual_lab.ladder import load_ladder, mirrored
from virtual_lab.paint import CoverPaint
from virtual_lab.pivot import record_pivot
from virtual_lab.record import record_capture, with_motion
from virtual_lab.rig import bare_bench, make_rig, object_bench
from virtual_lab.scene import Bench
from virtual_lab.seeds import seed_of
from virtual_lab.weighing import record_load, record_stiffness


def main(snakemake):
    """Write one experiment's folder and its truth."""
    output = snakemake.output
    sensor, experiment = snakemake.wildcards.recording.split("/")
    seed = seed_of(snakemake.params.common, sensor, experiment)
    with whole_folder(output.recording) as folder:
        truth = RECORDERS[experiment](folder, snakemake, seed)
        (folder / "recording.yaml").write_text("provenance: simulated\n", encoding="utf-8")
    with whole_file(output.truth) as part, part.open("wb") as stream:
        np.savez_compressed(stream, **truth)


def calibration(folder, snakemake, seed):
    """Pairs of colour and infrared images."""
    return record_calibration(folder, bare_rig(snakemake), snakemake.params.experiment, seed=seed)


def workspace(folder, snakemake, seed):
    """Tip on each point of a grid."""
    params = snakemake.params
    return record_workspace(
        folder, bare_rig(snakemake), params.common, params.experiment, params.probe, seed=seed
    )


def cd_case(folder, snakemake, seed):
    """Tip around a CD case."""
    params = snakemake.params
    bare = bare_bench(params.common, name="cd_case")
    device = device_of(params.common, {}, params.sensor)
    rng = np.random.default_rng(seed_of(params.common, "cd_case", "cover"))
    paint = CoverPaint(np.array(params.experiment["size_m"]), rng)
    bench = Bench(bare.table, paint, bare.props)
    rig = make_rig(params.common, device, params.experiment["camera"], bench)
    return record_trace(folder, rig, params.common, params.experiment, params.probe, seed=seed)


def loading(folder, snakemake, seed):
    """Press an object and hold."""
    params = snakemake.params
    options, common = params.experiment, params.common
    spec = with_motion(options["spec"], options["motion"])
    bench = object_bench(common, spec, name=options["object"])
    device = device_of(common, spec, params.sensor)
    rig = make_rig(common, device, spec["cameras"][params.sensor["sensor"]], bench)
    point = spec["object"]["points"][options["point"]]["position_m"]
    ladder = mirrored(load_ladder(snakemake.input.ladder), point)
    return record_capture(folder, rig, ladder, common, spec, params.probe, seed=seed)


def planes(folder, snakemake, seed):
    """Flat board at several distances."""
    record_planes(folder, bare_rig(snakemake), snakemake.params.experiment, seed=seed)
    return {}


def pivot(folder, snakemake, seed):
    """Handle that turns about its resting tip."""
    params = snakemake.params
    return record_pivot(folder, bare_rig(snakemake), params.experiment, params.probe, seed=seed)


def load(folder, snakemake, seed):
    """Probe held free in the air."""
    params, rig = snakemake.params, bare_rig(snakemake)
    return record_load(folder, rig, params.common, params.experiment, params.probe, seed=seed)


def stiffness(folder, snakemake, seed):
    """Ball pressed on something rigid."""
    params, rig = snakemake.params, bare_rig(snakemake)
    return record_stiffness(folder, rig, params.common, params.experiment, params.probe, seed=seed)


def bare_rig(snakemake):
    """The sensor before a table without an object."""
    params = snakemake.params
    bench = bare_bench(params.common, name=snakemake.wildcards.recording.split("/")[1])
    device = device_of(params.common, {}, params.sensor)
    return make_rig(params.common, device, params.experiment["camera"], bench)


RECORDERS = {
    "calibration": calibration,
    "workspace": workspace,
    "cd_case": cd_case,
    "loading": loading,
    "planes": planes,
    "pivot": pivot,
    "load": load,
    "stiffness": stiffness,
}
run(main, snakemake)
