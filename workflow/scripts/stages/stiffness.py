"""Find what the probe gives way by between its board and its ball."""

from palpate.capture.tables import read_force
from palpate.vision.bending import find_bending
from palpate.vision.bending_json import bending_fields
from palpate.vision.options import Force
from palpate.vision.rigid_press import way_and_force
from palpate.workflow.films import film_of_probe, write_calibration
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write stiffness.json."""
    _, table = film_of_probe(snakemake)
    params, film = snakemake.params, snakemake.input.film
    with naming(film):
        force = Force.read(params.force)
        found = find_bending(*way_and_force(table, read_force(film), params.probe, force))
    write_calibration(snakemake.output.stiffness, bending_fields(found, params.probe["probe"]))


run(main, snakemake)
