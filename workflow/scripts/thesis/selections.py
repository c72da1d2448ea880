"""Which captures and experiments of a run the thesis's tables and figures are made from."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from palpate.surface.trackers import options_of
from palpate.workflow.lab_captures import is_simulated
from palpate.workflow.run import BALL, EAR, Described, Run

# Figures that need no tracked surface, and so may show any capture.
UNTRACKED_FIGURES = {"figure_5_2"}
# Fewest captures that make a map, and that make a spread.
FEWEST_POINTS, FEWEST_ATTEMPTS = 4, 3
# The point of Figure 5.6 lies at an end of the block.
END_POINT = "17"
# Trackers whose surfaces the figures show.
DRAWN_TRACKERS = {"study", "unrefined", "single_view"}
SIMULATED_DATA = ("exact", "tracked")
# What is made of each experiment about a sensor.
READINGS = {
    "calibration": "calibration.json",
    "workspace": "workspace.csv",
    "cd_case": "cd_case_path.csv",
    "loading": "loading.csv",
}


def study(run: Run) -> Mapping:
    """The thesis's block of the configuration."""
    return run.config["study"]


def whole(run: Run) -> bool:
    """Whether the run is of all objects, and so of the recordings that are of none."""
    return run.config["only"] is None


def block(run: Run) -> str:
    """Name of the study's block."""
    return study(run)["block"]


# Captures.


def shown(run: Run, figure: str) -> list[Described]:
    """Captures that a figure shows: for each sensor the study's point, or else the first."""
    wanted = study(run)["figure_points"].get(figure)
    every = run.described("captures" if figure in UNTRACKED_FIGURES else "tracked")
    ours = [capture for capture in every if capture["object"] == block(run)] or every
    chosen = []
    for sensor in sorted({capture["sensor"] for capture in ours}):
        mine = [capture for capture in ours if capture["sensor"] == sensor]
        chosen.append(next((c for c in mine if c["capture"] == wanted), mine[0]))
    return chosen


def block_shown(run: Run, figure: str) -> list[Described]:
    """Captures of the block that a figure shows."""
    if not run.tracked:
        return []
    return [c for c in shown(run, figure) if c["object"] == block(run)]


def of_the_block(run: Run) -> list[Described]:
    """Captures of the study's block."""
    return [capture for capture in run.described() if capture["object"] == block(run)]


def over_the_block(run: Run, sensor: str | None = None) -> list[Described]:
    """Captures that are their point's only one: of a sensor, or of all with enough points."""
    single = [c for c in of_the_block(run) if c["capture"] == c["point"]]
    single = [c for c in single if c["point"].isdigit()]
    counts = [c["sensor"] for c in single]
    return [
        c
        for c in single
        if sensor in (None, c["sensor"]) and counts.count(c["sensor"]) >= FEWEST_POINTS
    ]


def attempts(run: Run) -> list[Described]:
    """Repeated presses of the block: captures whose names carry an attempt, per sensor."""
    return [c for c in of_the_block(run) if c["capture"] != c["point"]]


def repeated(run: Run) -> list[Described]:
    """Attempts at the one point, by one sensor, that has most of them."""
    places: dict[tuple, list] = {}
    for capture in attempts(run):
        places.setdefault((capture["sensor"], capture["point"]), []).append(capture)
    most = max(places.values(), key=len, default=[])
    return most if len(most) >= FEWEST_ATTEMPTS else []


def at_the_end(run: Run) -> list[Described]:
    """First tracked capture of the block's end point."""
    wanted = study(run)["figure_points"].get("figure_5_6", END_POINT)
    mine = [c for c in all_tracked(run, block(run)) if c["capture"] == wanted]
    return mine[:1]


def all_tracked(run: Run, name: str) -> list[Described]:
    """Every tracked capture of an object."""
    return [c for c in run.described("tracked") if c["object"] == name]


def table_5_3_captures(run: Run) -> list[Described]:
    """The study's points of its block; of dropped captures all of the block."""
    wanted = study(run)["table_5_3_points"]
    return [
        capture
        for capture in all_tracked(run, block(run))
        if capture["point"] in wanted or capture["provenance"] != "simulated"
    ]


def traced(run: Run) -> list[Described]:
    """Captures whose minimisations the study's figures show."""
    of_block = block_shown(run, "figure_5_8")
    return of_block + run.first_tracked(BALL) + run.first_tracked(EAR)


def simulated_tracked(run: Run) -> list[Described]:
    """Tracked captures whose truth the lab knows."""
    return run.described("tracked", simulated=True)


def stepped(run: Run) -> list[Described]:
    """Simulated captures whose steps are shown: the block's of Table 5.3, all of other objects."""
    wanted = study(run)["table_5_3_points"]
    return [
        capture
        for capture in simulated_tracked(run)
        if capture["object"] != block(run) or capture["point"] in wanted
    ]


def shrunk_balls(run: Run) -> list[Described]:
    """Captures of the ball that are tracked from one view and from turned clouds."""
    both = {"study", "single_view"} <= set(run.config["tracking"]["trackers"])
    return run.first_tracked(BALL) if both else []


def solids_counted(run: Run) -> list[Described]:
    """First tracked capture of each object whose solid the study counts the nodes of."""
    names = (block(run), BALL, EAR)
    return [mine[0] for mine in (all_tracked(run, name) for name in names) if mine]


def draws_trackers(run: Run) -> bool:
    """Whether the run has the trackers that the figures of tracked surfaces show."""
    return set(run.config["tracking"]["trackers"]) >= DRAWN_TRACKERS


# Files and values of captures.


def minima(run: Run, captures: Iterable[Described], errors: Sequence[str] | None = None) -> list:
    """Minima of captures, by capture and then by error option."""
    names = [f"minimise-{error}.json" for error in errors or run.errors]
    return run.files(captures, *names)


def material_of(run: Run, name: str) -> str | list:
    """True material of an object, where the lab makes it."""
    return run.truth(f"{name}/material.json") if name in run.made_materials else []


def truths(run: Run, captures: Iterable[Described]) -> list[str]:
    """Truth of captures that the lab makes."""
    return [run.truth(f"{c['object']}/{c['sensor']}/{c['capture']}/truth.npz") for c in captures]


def probes_of(run: Run, captures: Iterable[Described]) -> list[Mapping]:
    """Probe of each capture."""
    return [run.probe_of(capture["object"]) for capture in captures]


def sensors_of(run: Run, captures: Iterable[Described]) -> list[Mapping]:
    """Sensor of each capture."""
    return [run.sensors[capture["sensor"]] for capture in captures]


def tracker_of(run: Run, captures: Iterable[Described], tracker: str) -> list[Mapping]:
    """Options of a tracker for each capture's object."""
    return [options_of(run.config["tracking"], tracker, c["object"]) for c in captures]


def calibrations_of(run: Run, captures: Iterable[Described]) -> list[str]:
    """Calibration of each sensor whose file asks for it."""
    return [
        run.results(f"sensors/{capture['sensor']}/calibration.json")
        for capture in captures
        if run.sensors[capture["sensor"]].get("optics") == "calibration"
    ]


def tracker_inputs(run: Run, captures: Sequence[Described]) -> dict[str, list[str]]:
    """What a tracker gets of captures, by name."""
    names = [capture["object"] for capture in captures]
    return {
        "object": [run.raw(f"{name}/object.yaml") for name in names],
        "template": [run.template(name) for name in names],
        "solid": [run.results(f"{name}/solid.vtu") for name in names],
        "alignment": run.files(captures, "alignment.json"),
        "clouds": run.files(captures, "clouds.npz"),
        "pose": run.files(captures, "probe_pose.csv"),
        "force": run.files(captures, "force.csv"),
        "fits": run.files(captures, "hertz.json"),
    }


def steps_trackers(run: Run) -> list[str]:
    """Trackers that the steps of the error minimisation may use."""
    return list(dict.fromkeys([run.tracker, *run.config["tracking"]["compared"]]))


def steps(run: Run) -> dict:
    """Steps of the error minimisation whose tracker this run has made."""
    return {
        name: step
        for name, step in run.config["minimise"]["steps"].items()
        if step.get("tracker", run.tracker) in steps_trackers(run)
    }


# Experiments about the sensors, and the simulated block.


def experiments(run: Run, experiment: str) -> list[str]:
    """Sensors of which the run has an experiment."""
    return run.sensors_of(experiment) if whole(run) else []


def sensor_files(run: Run, experiment: str, name: str) -> list[str]:
    """A file of each sensor of which there is an experiment."""
    return [run.results(f"sensors/{sensor}/{name}") for sensor in run.sensors_of(experiment)]


def provenance(run: Run, experiment: str) -> dict[str, str]:
    """Whether sensors' recordings of an experiment are simulated, by sensor."""
    made = run.lab_experiments
    return {
        sensor: (
            "simulated"
            if f"{sensor}/{experiment}" in made
            or is_simulated(run.raw(f"sensors/{sensor}/{experiment}"))
            else "recorded"
        )
        for sensor in run.sensors_of(experiment)
    }


def read_experiments(run: Run) -> list[tuple[str, str]]:
    """Sensors and names of the lab's experiments that are held against its truth."""
    pairs = [(Path(name).parent.name, Path(name).name) for name in run.lab_experiments]
    return sorted(pair for pair in pairs if pair[1] in READINGS)


def probe_of_experiments(run: Run) -> Mapping:
    """Probe of the recordings about the sensors."""
    return run.probes[run.config["experiments"]["probe"]]


def simulated_steps(run: Run) -> str:
    """File of the simulated block's steps."""
    return run.raw("simulations/foam_block.npz")


def lab_simulates(run: Run) -> bool:
    """Whether the lab makes the simulated block in this run."""
    return whole(run) and run.lab is not None and "simulated_block" in run.lab


def has_simulation(run: Run) -> bool:
    """Whether the run has the simulated block."""
    return whole(run) and (lab_simulates(run) or Path(simulated_steps(run)).exists())


def simulation_truth(run: Run) -> str | list:
    """True moduli of the simulated block, where the lab makes it."""
    return run.truth("simulations/foam_block.json") if lab_simulates(run) else []


def simulation_options(run: Run, *names: str) -> dict:
    """Some of the simulation's options, so that the others re-run nothing."""
    return {name: run.config["simulation"][name] for name in names}


def lab_records(run: Run) -> bool:
    """Whether the lab makes recordings about the sensors, or the simulated block."""
    has = run.lab is not None and (bool(run.lab_experiments) or "simulated_block" in run.lab)
    return whole(run) and has


def objects_shown(run: Run) -> list[Described]:
    """Tracked captures that the page of objects shows: one per object and sensor."""
    others = sorted({c.object for c in run.tracked} - {block(run)})
    mine = block_shown(run, "tracked_surface")
    return [*mine, *(capture for name in others for capture in run.first_tracked(name))]


def block_captured(run: Run) -> bool:
    """Whether the study's block was captured."""
    return block(run) in {capture.object for capture in run.captures}
