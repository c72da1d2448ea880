"""Record the bare table of an object of the lab."""

from palpate.capture.files import whole_folder
from palpate.workflow.job import run
from virtual_lab.rig import make_rig, object_bench
from virtual_lab.rig_errors import errors_of, seed_of
from virtual_lab.scene import Scene


def main(snakemake):
    """Write the background folder of one sensor."""
    params, name = snakemake.params, snakemake.wildcards.object
    common, spec, sensor = params.common, params.spec, snakemake.wildcards.sensor
    bench = object_bench(common, spec, name=name)
    errors = errors_of(common, spec, params.sensor)
    rig = make_rig(common, errors, spec["cameras"][sensor], bench)
    # Of single rig errors each is a sensor, and all share what goes by the name of one.
    seed = seed_of(common, name, params.sensor["sensor"], "background")
    with whole_folder(snakemake.output.background) as folder:
        rig.write_still(folder, Scene(bench), frames=common["background_frames"], seed=seed)


run(main, snakemake)
