"""Record an experiment about a sensor or the probe that it records."""

from palpate.capture.files import whole_folder
from palpate.npz import write_npz
from palpate.workflow.job import run
from virtual_lab.load_steps import mirrored, read_load_steps
from virtual_lab.probe_experiments import record_load, record_pivot, record_stiffness
from virtual_lab.record import record_capture, with_motion
from virtual_lab.rig import bare_bench, make_rig, object_bench
from virtual_lab.rig_errors import errors_of, seed_of
from virtual_lab.sensor_experiments import (
    record_calibration,
    record_planes,
    record_trace,
    record_workspace,
)

# Those before a table without an object; ``loading`` indents one.
RECORDERS = {
    "calibration": record_calibration,
    "workspace": record_workspace,
    "cd_case": record_trace,
    "planes": record_planes,
    "pivot": record_pivot,
    "load": record_load,
    "stiffness": record_stiffness,
}


def main(snakemake):
    """Write one experiment's folder and its truth."""
    params, output = snakemake.params, snakemake.output
    common, options = params.common, params.experiment
    sensor, name = snakemake.wildcards.recording.split("/")
    seed = seed_of(common, sensor, name)
    with whole_folder(output.recording) as folder:
        if name == "loading":
            truth = loading(folder, snakemake.input.load_steps, params, seed)
        else:
            bench, errors = bare_bench(common, name=name), errors_of(common, {}, params.sensor)
            rig = make_rig(common, errors, options["camera"], bench)
            truth = RECORDERS[name](folder, rig, options, params.probe, seed=seed)
        (folder / "recording.yaml").write_text("provenance: simulated\n", encoding="utf-8")
    write_npz(output.truth, truth)


def loading(folder, file, params, seed):
    """Indent an object and hold."""
    options, common = params.experiment, params.common
    spec = with_motion(options["spec"], options["motion"])
    bench = object_bench(common, spec, name=options["object"])
    camera = spec["cameras"][params.sensor["sensor"]]
    rig = make_rig(common, errors_of(common, spec, params.sensor), camera, bench)
    point = spec["object"]["points"][options["point"]]["position_m"]
    steps = mirrored(read_load_steps(file), point)
    return record_capture(folder, rig, steps, spec, params.probe, seed=seed)


run(main, snakemake)
