# What the rules that draw tracked surfaces share.
from types import SimpleNamespace

# Objects of Sections 5.2.2 and 5.2.3.
# The point of Figure 5.6 lies at an end of the block.
END_POINT = "17"
# Trackers whose surfaces the figures show.
DRAWN_TRACKERS = {"study", "unrefined", "single_view"}


def tracked_of(name):
    """First tracked capture of an object by each sensor."""
    mine = [c for c in HOUSE.described(tracked=True) if c["object"] == name]
    first = {capture["sensor"]: capture for capture in reversed(mine)}
    return [first[sensor] for sensor in sorted(first)]


def at_the_end():
    """First tracked capture of the block's end point."""
    block = config["study"]["block"]
    wanted = config["study"]["figure_points"].get("figure_5_6", END_POINT)
    return [
        capture
        for capture in HOUSE.described(tracked=True)
        if capture["object"] == block and capture["capture"] == wanted
    ][:1]


def block_shown(figure):
    """Captures of the block that a figure shows."""
    block = config["study"]["block"]
    return [c for c in shown(figure) if c["object"] == block] if HOUSE.tracked else []


def recorded_files(captures):
    """What a tracker gets of captures, by name."""
    named = [SimpleNamespace(**capture) for capture in captures]
    return {
        "object": [raw(f"{capture.object}/object.yaml") for capture in named],
        "template": [template_of(capture).format(**vars(capture)) for capture in named],
        "solid": [results(f"{capture.object}/solid.vtu") for capture in named],
        "alignment": files_of(captures, "alignment.json"),
        "clouds": files_of(captures, "clouds.npz"),
        "pose": files_of(captures, "probe_pose.csv"),
        "force": files_of(captures, "force.csv"),
        "fits": files_of(captures, "hertz.json"),
    }


def calibrations_of(captures):
    """Calibration of each sensor whose file asks for it."""
    return [
        results(f"sensors/{capture['sensor']}/calibration.json")
        for capture in captures
        if HOUSE.sensors[capture["sensor"]].get("optics") == "calibration"
    ]


def probes_of(captures):
    return [HOUSE.probe_of(capture["object"]) for capture in captures]


def sensors_shown(captures):
    return [HOUSE.sensors[capture["sensor"]] for capture in captures]


def options_shown(captures, tracker):
    """Options of a tracker for each capture's object."""
    return [options_of(config["tracking"], tracker, c["object"]) for c in captures]


def tracking_figure_outputs():
    """Figures of tracked surfaces that the run has captures for."""
    names = []
    if not DRAWN_TRACKERS <= set(config["tracking"]["trackers"]):
        return []
    if block_shown("figure_5_5"):
        names += ["figure_5_5", "figure_5_7"]
    if at_the_end():
        names.append("figure_5_6")
    if tracked_of(BALL):
        names += ["figure_5_11", "figure_5_12", "figure_5_13"]
    if tracked_of(EAR):
        names.append("figure_5_16")
    if HOUSE.described(simulated=True, tracked=True):
        names.append("tracking_accuracy")
    return [f"{RESULTS}/figures/{name}.png" for name in names]
