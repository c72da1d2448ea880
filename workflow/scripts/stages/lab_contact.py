"""Press the rigid sphere into an object of the lab over a ladder of depths."""

from palpate.workflow.job import run
from virtual_lab.device import sphere_radius_m
from virtual_lab.ladder import save_ladder
from virtual_lab.obstacle import DOWN
from virtual_lab.press import press_object


def main(snakemake):
    """Solve the contact problem of one point."""
    spec = snakemake.params.spec
    place = spec["points"][snakemake.wildcards.point]
    ladder = press_object(
        spec,
        place["position_m"],
        sphere_radius_m(spec, spec, snakemake.params.probe),
        direction=place.get("direction", DOWN),
    )
    save_ladder(snakemake.output.ladder, ladder)


run(main, snakemake)
