"""Films of the probe alone, as the lab makes them for what calibrates it."""

import yaml
from virtual_lab.probe_experiments import record_load, record_pivot, record_stiffness
from virtual_lab.rig import bare_bench, make_rig
from virtual_lab.rig_errors import errors_of

RECORDERS = {"load": record_load, "pivot": record_pivot, "stiffness": record_stiffness}
APART = ("objects", "experiments", "simulated_block", "laser")


def lab_film(root, folder, sensor, probe, **changed):
    """Record the experiment that a folder is named by; gives its truth."""
    lab = yaml.safe_load((root / "config/lab.yaml").read_text())
    options = lab["experiments"][folder.name] | changed
    common = {key: value for key, value in lab.items() if key not in APART}
    common["background_frames"] = 3
    folder.mkdir(parents=True)
    bench = bare_bench(common, name=folder.name)
    rig = make_rig(common, errors_of(common, {}, sensor), options["camera"], bench)
    return RECORDERS[folder.name](folder, rig, options, probe, seed=[1])
