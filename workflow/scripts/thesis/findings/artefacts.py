"""Entries of what the study printed and found, beside ours."""

from collections.abc import Mapping

from palpate.workflow.run import Run

from thesis import selections as select
from thesis.artefact import COMPARISON, Artefact, table

PRINTED = ("table_4_1", "equation_4_12", "table_4_2", "simulation", "text") + tuple(
    f"table_5_{number}" for number in range(1, 6)
)


def _our_tables(run: Run) -> list[str]:
    """Tables of the run that have counterparts of printed numbers or bear on findings."""
    made = {
        "cd_case": select.experiments(run, "cd_case"),
        "equation_4_12": select.experiments(run, "calibration"),
        "pipeline_accuracy": select.simulated_tracked(run),
        "simulation": select.has_simulation(run),
        "simulation_noise": select.has_simulation(run),
        "table_4_1": select.experiments(run, "calibration"),
        "table_4_2": select.experiments(run, "workspace"),
        "table_5_1": select.attempts(run),
        "table_5_2": True,
    }
    names = [name for name, there in made.items() if there]
    return [run.results("summary.csv"), *(run.results(f"tables/{name}.csv") for name in names)]


def _linear(run: Run) -> str | list:
    """Linear method on the simulated block's exact data, where the run has it."""
    return run.results("simulation/linear-exact.json") if select.has_simulation(run) else []


def _calibrated_by_lab(run: Run) -> dict[str, Mapping]:
    """Sensors whose calibration pictures the lab makes: their files hold the truth."""
    made = set(run.lab_experiments)
    return {name: spec for name, spec in run.sensors.items() if f"{name}/calibration" in made}


def _shared(run: Run) -> dict:
    return {
        "tables": _our_tables(run),
        "minima": select.minima(run, select.traced(run), run.errors[:1]),
        "linear": _linear(run),
        "published": [run.published(name) for name in PRINTED],
    }


ARTEFACTS = (
    Artefact(
        "comparison",
        title="Every printed number of the study beside ours",
        caption="One row a number, in the unit of its column ``unit``: published, ours, their"
        " ratio, and the truth where the lab knows it. The study pressed real objects, the lab"
        " simulated ones of other stiffness, so a ratio off 1 is no error by itself; ``true`` is"
        " what ours should be.\n\nOurs of ``selected_threshold`` comes of the rule of selection:"
        " deviations fall with the threshold and flatten without a clear minimum, and the smallest"
        " threshold within 2 % of the least is taken.",
        make="thesis.findings.compared_tables:make_comparison",
        outputs=table("comparison"),
        inputs=lambda run, captures: (
            _shared(run)
            | {
                "solids": [
                    run.results(f"{c['object']}/solid.vtu") for c in select.solids_counted(run)
                ],
                "materials": run.materials(),
                "simulated": select.simulation_truth(run),
            }
        ),
        params=lambda run, captures: {
            "captures": select.traced(run),
            "error": run.errors[0],
            "solids": select.solids_counted(run),
            "materials": run.made_materials,
            "calibrated": _calibrated_by_lab(run),
        },
        chapter=COMPARISON,
        local=True,
    ),
    Artefact(
        "findings",
        title="Findings of the study as statements that can fail",
        caption="Each finding with the numbers printed for it, ours (moduli in Pa or as ratios, p"
        " values), the rule of decision, and whether it holds. The same rule is applied to both."
        " *Does not hold* asks for evidence of the opposite; p values are not corrected for the"
        " number of findings: about one test in twenty would come out by chance alone. Findings on"
        " nu count only minima that identify it. What the lab's objects exclude (a block stiffer in"
        " places) is *not testable here*; the order of stiffness is the lab's choice.",
        make="thesis.findings.compared_tables:make_findings",
        outputs=table("findings"),
        inputs=lambda run, captures: (
            _shared(run)
            | {
                "workspaces": [
                    run.results(f"sensors/{sensor}/workspace.csv")
                    for sensor in select.experiments(run, "workspace")
                ],
                "fits": run.files(select.shrunk_balls(run), "hertz.json"),
                "single_view": run.files(select.shrunk_balls(run), "tracked-single_view.npz"),
                "turned": run.files(select.shrunk_balls(run), "tracked-study.npz"),
            }
        ),
        params=lambda run, captures: {
            "captures": select.traced(run),
            "error": run.errors[0],
            "workspaces": select.experiments(run, "workspace"),
            "balls": select.shrunk_balls(run),
        },
        chapter=COMPARISON,
        local=True,
    ),
)
