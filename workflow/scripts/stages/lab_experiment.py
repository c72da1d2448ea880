"""Record an experiment about a sensor or the probe that it films."""

from palpate.capture.files import whole_folder
from palpate.npz import write_npz
from palpate.workflow.job import run
from virtual_lab.calibration import record_calibration
from virtual_lab.device import device_of
from virtual_lab.experiments import record_planes, record_trace, record_workspace
from virtual_lab.ladder import load_ladder, mirrored
from virtual_lab.pivot import record_pivot
from virtual_lab.record import record_capture, with_motion
from virtual_lab.rig import bare_bench, make_rig, object_bench
from virtual_lab.seeds import seed_of
from virtual_lab.weighing import record_load, record_stiffness

# Those before a table without an object; ``loading`` presses one.
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
            truth = loading(folder, load_ladder(snakemake.input.ladder), params, seed)
        else:
            bench, device = bare_bench(common, name=name), device_of(common, {}, params.sensor)
            rig = make_rig(common, device, options["camera"], bench)
            truth = RECORDERS[name](folder, rig, common, options, params.probe, seed=seed)
        (folder / "recording.yaml").write_text("provenance: simulated\n", encoding="utf-8")
    write_npz(output.truth, truth)


def loading(folder, ladder, params, seed):
    """Press an object and hold."""
    options, common = params.experiment, params.common
    spec = with_motion(options["spec"], options["motion"])
    bench = object_bench(common, spec, name=options["object"])
    device = device_of(common, spec, params.sensor)
    rig = make_rig(common, device, spec["cameras"][params.sensor["sensor"]], bench)
    ladder = mirrored(ladder, spec["object"]["points"][options["point"]]["position_m"])
    return record_capture(folder, rig, ladder, common, spec, params.probe, seed=seed)


run(main, snakemake)
