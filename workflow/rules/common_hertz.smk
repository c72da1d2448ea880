# What the rules of the Hertz model (Section 5.1) share.
def attempts():
    """Repeated presses of the block: captures whose names carry an attempt, per sensor."""
    block = config["study"]["block"]
    return [
        capture
        for capture in HOUSE.described()
        if capture["object"] == block and capture["capture"] != capture["point"]
    ]


def hertz_outputs():
    """Tables of the Hertz model."""
    names = ["table_5_2"]
    names += ["table_5_1"] if attempts() else []
    names += ["hertz_accuracy"] if HOUSE.simulated_captures else []
    return [f"{RESULTS}/tables/{name}.csv" for name in names]
