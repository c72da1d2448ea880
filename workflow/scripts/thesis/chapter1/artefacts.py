"""Entry of Chapter 1."""

from thesis.artefact import Artefact, figure
from thesis.chapter1.moduli_rules import way_to_moduli

ARTEFACTS = (
    Artefact(
        "figure_1_1",
        title="Figure 1.1: the pipeline from capture to parameters",
        caption="Drawn from the workflow's own rules. Beside it in the study: the overview of"
        " Figure 1.1.",
        make="thesis.chapter1.rule_graph:make_figure_1_1",
        outputs=figure("figure_1_1"),
        params=lambda run, captures: {"rules": lambda wildcards: way_to_moduli(run, run.rules)},
        made=lambda run: bool(run.minimised),
    ),
)
