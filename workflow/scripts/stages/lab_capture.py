"""Record one indentation in the lab: the capture, and its truth apart."""

from palpate.capture.files import whole_folder
from palpate.npz import write_npz
from palpate.workflow.job import run
from virtual_lab.device import device_of
from virtual_lab.ladder import load_ladder, mirrored
from virtual_lab.record import record_capture
from virtual_lab.rig import make_rig, object_bench
from virtual_lab.seeds import seed_of

# Snakemake sets it too, after the job.
MADE_BY_A_RULE = ".snakemake_timestamp"


def main(snakemake):
    """Write one capture's folder and truth.npz."""
    params, wildcards = snakemake.params, snakemake.wildcards
    name, sensor, capture = wildcards.object, wildcards.sensor, wildcards.capture
    drawn = params.sensor["sensor"]
    bench = object_bench(params.common, params.spec, name=name)
    placement, motion = params.spec["cameras"][sensor], params.spec["motion"]
    device = device_of(params.common, params.spec, params.sensor)
    stand = params.common, device, placement, bench
    bumped = {"bumped_deg": motion.get("bumped_deg", (0, 0, 0))}
    rig, jolt_m = make_rig(*stand, **bumped), motion.get("jolted_m")
    jolted = make_rig(*stand, **bumped, jolted_m=jolt_m) if jolt_m else None
    ladder = mirrored(load_ladder(snakemake.input.ladder), params.place["position_m"])
    seed = seed_of(params.common, name, drawn, capture)
    with whole_folder(snakemake.output.capture) as folder:
        truth = record_capture(
            folder,
            rig,
            ladder,
            params.common,
            params.spec,
            params.probe,
            seed=seed,
            jolted=jolted,
        )
        # Without it a run that is killed just now leaves what looks like a recording of people's.
        (folder / MADE_BY_A_RULE).touch()
    write_npz(snakemake.output.truth, truth)


run(main, snakemake)
