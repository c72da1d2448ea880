"""Find where the ball is in the frame of the probe's board."""

from palpate.vision.filmed_pivot import filmed_pivot
from palpate.vision.marker import board_of
from palpate.vision.pivot_json import pivot_fields
from palpate.vision.probe import marker_transforms
from palpate.workflow.films import film_of_probe, write_calibration
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write tip.json."""
    sensor, table = film_of_probe(snakemake)
    probe = snakemake.params.probe
    with naming(snakemake.input.film):
        names = [f"frame {k}" for k in table["frame"]]
        board = board_of(probe["marker"])
        found = filmed_pivot(marker_transforms(table), names, board, sensor["color"])
    write_calibration(snakemake.output.tip, pivot_fields(found, names, probe["probe"]))


run(main, snakemake)
