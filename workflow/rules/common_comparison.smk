# What the rules share that hold the study's numbers and findings against ours.
# Shown of a minimisation whose later iterations change nothing (Figure 5.9).
FIRST_ITERATIONS = 40
# Of the views that show the whole of an object from the side of the camera.
ELEVATION_DEG = {BALL: 20, EAR: None}

# Objects whose true material the lab knows.
MADE_MATERIALS = sorted({capture.object for capture in HOUSE.simulated_captures})


def minima_of(captures, errors=ERRORS):
    """Minima of captures, by capture and then by error option."""
    return [
        path
        for capture in captures
        for error in errors
        for path in files_of([capture], f"minimise-{error}.json")
    ]


def all_tracked_of(name):
    """Every tracked capture of an object."""
    return [c for c in HOUSE.described(tracked=True) if c["object"] == name]


def material_of(name):
    """True material of an object, where the lab makes it."""
    return truth(f"{name}/material.json") if name in MADE_MATERIALS else []


def estimate_outputs():
    """Tables 5.3 to 5.5 and the figures of the minimisations that the run has captures for."""
    tables, figures = [], []
    if all_tracked_of(config["study"]["block"]):
        tables.append("table_5_3_all")
    if HOUSE.tracked:
        figures.append("figure_5_9")
    if tracked_of(BALL):
        tables.append("table_5_4")
        figures += ["figure_5_14", "figure_5_15"]
    if tracked_of(EAR):
        tables.append("table_5_5")
        figures += ["figure_5_17", "figure_5_18"]
    return [f"{RESULTS}/tables/{name}.csv" for name in tables] + [
        f"{RESULTS}/figures/{name}.png" for name in figures
    ]


def compared_tables():
    """Tables of the run that have counterparts of printed numbers or bear on findings."""
    made = [*seeing_outputs()] if config["only"] is None else []
    made += hertz_outputs() + simulation_outputs()
    names = {Path(path).stem for path in made if path.endswith(".csv")}
    names &= {"table_4_1", "table_4_2", "cd_case", "table_5_1", "table_5_2"} | {
        "simulation",
        "simulation_noise",
    }
    names |= {"equation_4_12"} if "table_4_1" in names else set()
    if HOUSE.described(simulated=True, tracked=True):
        names.add("pipeline_accuracy")
    return [results("summary.csv")] + [
        results(f"tables/{name}.csv") for name in sorted(names)
    ]


def printed_tables():
    """The study's printed numbers."""
    names = ["table_4_1", "equation_4_12", "table_4_2", "simulation", "text"]
    names += [f"table_5_{number}" for number in range(1, 6)]
    return [published(name) for name in names]


def traced_captures():
    """Captures whose minimisations the study's figures show."""
    block = config["study"]["block"]
    of_block = (
        [c for c in shown("figure_5_8") if c["object"] == block]
        if HOUSE.tracked
        else []
    )
    return of_block + tracked_of(BALL) + tracked_of(EAR)


def solids_counted():
    """First tracked capture of each object whose solid the study counts the nodes of."""
    names = (config["study"]["block"], BALL, EAR)
    return [mine[0] for mine in map(all_tracked_of, names) if mine]


def linear_on_exact_data():
    """Linear method on the simulated block's exact data, where the run has it."""
    there = any("tables/simulation.csv" in path for path in simulation_outputs())
    return results("simulation/linear-exact.json") if there else []


def calibrated_by_lab():
    """Sensors whose calibration pictures the lab makes: their files hold the truth."""
    made = set(HOUSE.lab_experiments)
    return {n: spec for n, spec in HOUSE.sensors.items() if f"{n}/calibration" in made}


def workspace_sensors():
    """Sensors whose workspace the run has."""
    return sensors_of("workspace") if config["only"] is None else []


def shrunk_balls():
    """Captures of the ball that are tracked from one view and from turned clouds."""
    both = {"study", "single_view"} <= set(config["tracking"]["trackers"])
    return tracked_of(BALL) if both else []


def comparison_outputs():
    """Comparison and findings."""
    return [results("tables/comparison.csv"), results("tables/findings.csv")]
