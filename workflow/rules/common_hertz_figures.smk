# What the rules that draw the Hertz model and the diagrams of Chapter 3 share.
# Fewest captures that make a map, and that make a spread.
FEWEST_POINTS, FEWEST_ATTEMPTS = 4, 3
APPENDIX = {"figure_a_1": "bumblebee", "figure_a_2": "kinect"}


def of_the_block():
    """Described captures of the study's block."""
    block = config["study"]["block"]
    return [capture for capture in HOUSE.described() if capture["object"] == block]


def over_the_block(sensor=None):
    """Captures that are their point's only one: of a sensor, or of all with enough points."""
    single = [c for c in of_the_block() if c["capture"] == c["point"]]
    single = [c for c in single if c["point"].isdigit()]
    counts = [c["sensor"] for c in single]
    return [
        c
        for c in single
        if sensor in (None, c["sensor"]) and counts.count(c["sensor"]) >= FEWEST_POINTS
    ]


def repeated():
    """Attempts at the one point, by one sensor, that has most of them."""
    places = {}
    for capture in of_the_block():
        if capture["capture"] != capture["point"]:
            key = capture["sensor"], capture["point"]
            places.setdefault(key, []).append(capture)
    most = max(places.values(), key=len, default=[])
    return most if len(most) >= FEWEST_ATTEMPTS else []


def grid_template():
    """Template of the object that Figure 5.1 shows."""
    kind, name = HOUSE.template_source(shown("figure_5_1")[0]["object"])
    if kind == "file":
        return seen_raw("figure_5_1", f"{{object}}/{name}")
    return seen_in("figure_5_1", "{object}/template.ply")


def grid_optics():
    """Calibration of the sensor that Figure 5.1 shows, where its file asks for it."""
    sensor = shown("figure_5_1")[0]["sensor"]
    if HOUSE.sensors[sensor].get("optics") != "calibration":
        return []
    return results(f"sensors/{sensor}/calibration.json")


def hertz_figure_outputs():
    """Figures of the Hertz model that the run has captures for."""
    names = []
    if of_the_block():
        names.append("figure_5_1")
    if repeated():
        names.append("figure_5_3")
    if over_the_block():
        names.append("figure_5_4")
    names += [name for name, sensor in APPENDIX.items() if over_the_block(sensor)]
    return [f"{RESULTS}/figures/{name}.png" for name in names]


def diagram_outputs():
    """Diagrams of Chapter 3; Figure 3.8 steps down the error of the lab's simulated block."""
    simulated = HOUSE.lab is not None and "simulated_block" in HOUSE.lab
    names = ["figure_3_1", "figure_3_2"] + ["figure_3_8"] * simulated
    return [f"{RESULTS}/figures/{name}.png" for name in names]
