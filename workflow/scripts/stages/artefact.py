"""A table, a figure, or what several of them share: what the rule's function makes of its inputs.

The function is named as ``module:function``, takes the rule's inputs and params, and returns what
`palpate.report.outputs.write` writes, or a table whose title and notes are in the params.
"""

from importlib import import_module

import pandas as pd
from palpate.report import outputs, style
from palpate.workflow.job import run


def main(snakemake):
    """Make and write."""
    module, _, name = snakemake.params.make.partition(":")
    make = getattr(import_module(module), name)
    with style.journal():
        made = make(snakemake.input, snakemake.params)
        if isinstance(made, pd.DataFrame):
            made = outputs.table(made, **snakemake.params.table)
        outputs.write(made, snakemake.output)


run(main, snakemake)
