# What the rules of the error minimisation's steps share.
def stepped_captures():
    """Simulated captures whose steps are shown: the block's of Table 5.3, all of other objects."""
    block, wanted = config["study"]["block"], config["study"]["table_5_3_points"]
    return [
        capture
        for capture in HOUSE.described(simulated=True, tracked=True)
        if capture["object"] != block or capture["point"] in wanted
    ]


def minimise_steps():
    """Steps whose tracker this run has made."""
    return {
        name: step
        for name, step in config["minimise"]["steps"].items()
        if step.get("tracker", TRACKER) in stepped_trackers()
    }


def stepped_trackers():
    """Trackers that the steps may use."""
    return list(dict.fromkeys([TRACKER, *config["tracking"]["compared"]]))


def minimise_steps_figures():
    """Figure of the steps, where the lab makes captures to judge them by."""
    return [f"{RESULTS}/figures/minimise_steps.png"] if stepped_captures() else []
