"""Record one indentation in the lab: the capture, and its truth apart."""

from functools import partial

from palpate.capture.files import whole_folder
from palpate.npz import write_npz
from palpate.workflow.job import run
from virtual_lab.load_steps import mirrored, read_load_steps
from virtual_lab.record import record_capture
from virtual_lab.rig import make_rig, object_bench
from virtual_lab.rig_errors import errors_of, seed_of

# Snakemake sets it too, after the job.
MADE_BY_A_RULE = ".snakemake_timestamp"


def main(snakemake):
    """Write one capture's folder and truth.npz."""
    params, wildcards = snakemake.params, snakemake.wildcards
    name, sensor, capture = wildcards.object, wildcards.sensor, wildcards.capture
    common, spec, motion = params.common, params.spec, params.spec["motion"]
    errors, bench = errors_of(common, spec, params.sensor), object_bench(common, spec, name=name)
    bumped = {"bumped_deg": motion.get("bumped_deg", (0, 0, 0))}
    placed = partial(make_rig, common, errors, spec["cameras"][sensor], bench, **bumped)
    jolt_m = motion.get("jolted_m")
    rigs = {"rig": placed(), "jolted": placed(jolted_m=jolt_m) if jolt_m else None}
    steps = mirrored(read_load_steps(snakemake.input.load_steps), params.place["position_m"])
    options = {"spec": spec, "probe_spec": params.probe}
    seed = seed_of(common, name, params.sensor["sensor"], capture)
    with whole_folder(snakemake.output.capture) as folder:
        truth = record_capture(folder, steps=steps, **rigs, **options, seed=seed)
        # Without it a run that is killed just now leaves what looks like a recording of people's.
        (folder / MADE_BY_A_RULE).touch()
    write_npz(snakemake.output.truth, truth)


run(main, snakemake)
