"""The table of all tables and figures of the thesis: one entry each, in the report's order."""

from palpate.workflow.run import Run

from thesis.accuracy import artefacts as accuracy
from thesis.artefact import Artefact
from thesis.chapter1 import artefacts as chapter1
from thesis.chapter3 import artefacts as chapter3
from thesis.chapter4 import artefacts as chapter4
from thesis.chapter4.experiment_artefacts import EXPERIMENTS
from thesis.chapter5 import artefacts as chapter5
from thesis.findings import artefacts as findings

ARTEFACTS: tuple[Artefact, ...] = (
    *chapter1.ARTEFACTS,
    *chapter3.ARTEFACTS,
    *chapter4.ARTEFACTS,
    *chapter5.ARTEFACTS,
    *findings.ARTEFACTS,
    *accuracy.ARTEFACTS,
)

# Of recordings about the sensors.
OF_SENSORS = (
    *EXPERIMENTS,
    *(entry for entry in accuracy.ARTEFACTS if entry.name == "sensor_accuracy"),
)


def in_run(run: Run) -> list[Artefact]:
    """Entries that a run can make."""
    return [entry for entry in ARTEFACTS if entry.in_run(run)]


def wanted_of(run: Run, *, of_sensors: bool = False) -> list[str]:
    """Files of the entries that a run makes for their own sake.

    Parameters
    ----------
    run : Run
    of_sensors : bool, optional
        Just those of recordings about the sensors, which are of nobody's object.
    """
    return [
        path
        for entry in in_run(run)
        if entry.wanted and not (of_sensors and entry not in OF_SENSORS)
        for path in entry.rule_outputs(run).values()
    ]
