"""Film the bare table of an object of the lab."""

from palpate.capture.files import whole_folder
from palpate.workflow.job import run
from virtual_lab.device import device_of
from virtual_lab.rig import make_rig, object_bench
from virtual_lab.scene import Scene
from virtual_lab.seeds import seed_of


def main(snakemake):
    """Write the background folder of one sensor."""
    params, name = snakemake.params, snakemake.wildcards.object
    # Errors that are filmed alone are cameras of one device: what is drawn goes by its name.
    drawn, sensor = params.sensor["sensor"], snakemake.wildcards.sensor
    bench = object_bench(params.common, params.spec, name=name)
    device = device_of(params.common, params.spec, params.sensor)
    rig = make_rig(params.common, device, params.spec["cameras"][sensor], bench)
    seed = seed_of(params.common, name, drawn, "background")
    with whole_folder(snakemake.output.background) as folder:
        rig.write_still(folder, Scene(bench), frames=params.common["background_frames"], seed=seed)


run(main, snakemake)
