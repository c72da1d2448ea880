"""Figure of the error's profile over Poisson's ratio."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import style
from palpate.study.profile_figure import poisson_profiles
from study_inputs import minima_by_key


def main(snakemake):
    """Draw the figure."""
    params = snakemake.params
    minima = minima_by_key(params.captures, params.errors, snakemake.input.results)
    with style.journal():
        figure = poisson_profiles(params.captures, minima)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
