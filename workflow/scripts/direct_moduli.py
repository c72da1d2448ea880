"""Figure of the direct estimates."""

from pathlib import Path

from job import run
from palpate.capture.files import whole_file
from palpate.study import style
from palpate.study.direct_figure import direct_moduli
from study_inputs import read_all


def main(snakemake):
    """Draw the figure."""
    inputs, params = snakemake.input, snakemake.params
    names = [Path(path).parent.name for path in inputs.materials]
    materials = dict(zip(names, read_all(inputs.materials), strict=True))
    with style.journal():
        figure = direct_moduli(
            params.captures,
            read_all(inputs.direct),
            params.groups,
            read_all(inputs.joint),
            materials,
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
