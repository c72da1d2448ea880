"""A table, a figure, or what several of them share: what the rule's function makes of its inputs.

The function is named as ``module:function``, takes the rule's inputs and params, and returns what
`palpate.report.outputs.write` writes.
"""

from importlib import import_module

from palpate.report import outputs, style
from palpate.workflow.job import run


def main(snakemake):
    """Make and write."""
    module, _, name = snakemake.params.make.partition(":")
    make = getattr(import_module(module), name)
    with style.journal():
        outputs.write(make(snakemake.input, snakemake.params), snakemake.output)


run(main, snakemake)
