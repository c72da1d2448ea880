# Captures of the validation set: materials that nothing was tuned on (config/validation.yaml).
VALIDATED = ["clouds.npz", "alignment.json", "force.csv", "probe_pose.csv"]


def validation_outputs():
    """What every capture of the set is taken to, and the solid mesh of every object."""
    captures = HOUSE.described(simulated=True)
    solids = [results(f"{name}/solid.vtu") for name in LAB_OBJECTS]
    return solids + [path for name in VALIDATED for path in files_of(captures, name)]
