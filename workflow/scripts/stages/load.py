"""Find what hangs on the force sensor, and how the sensor is turned against the board."""

from palpate.capture.tables import read_force
from palpate.vision.clouds import table_of
from palpate.vision.load import find_load
from palpate.vision.load_json import load_fields
from palpate.vision.options import SupportPlane
from palpate.vision.rests import film_rests
from palpate.workflow.films import film_of_probe, write_calibration
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write load.json."""
    sensor, table = film_of_probe(snakemake)
    params, film = snakemake.params, snakemake.input.film
    plane = SupportPlane.read(params.plane)
    with naming(film):
        up = table_of(f"{film}/background", sensor, plane, seed=params.seed)[:3]
        rests = film_rests(table, read_force(film), params.probe)
        found = find_load(rests.turns, rests.wrench, up, rests.noise, rests.names)
    fields = load_fields(found, rests.names, params.probe["probe"])
    write_calibration(snakemake.output.load, fields)


run(main, snakemake)
