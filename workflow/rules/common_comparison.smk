# What the rules share that hold the study's numbers and findings against ours.
# Shown of a minimisation whose later iterations change nothing (Figure 5.9).
FIRST_ITERATIONS = 40
# Of the views that show the whole of an object from the side of the camera.
ELEVATION_DEG = {BALL: 20, EAR: None}


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
    made = {capture.object for capture in HOUSE.simulated_captures}
    return truth(f"{name}/material.json") if name in made else []


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
