"""Film the bare table of an object of the lab."""

from job import run
from palpate.capture.files import whole_folder
from palpate.lab.record import make_rig, record_background, seed_of


def main(snakemake):
    """Write the background folder of one sensor."""
    common, name, sensor = (
        snakemake.params.common,
        snakemake.wildcards.object,
        snakemake.params.sensor,
    )
    rig = make_rig(common, snakemake.params.spec, sensor, name=name)
    seed = seed_of(common, name, sensor["sensor"], "background")
    with whole_folder(snakemake.output.background) as folder:
        record_background(folder, rig, frames=common["background_frames"], seed=seed)


run(main, snakemake)
