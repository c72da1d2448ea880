# Discovery, checks and paths shared by the rules. Nothing here computes a result.
import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError

sys.path[:0] = [str(Path(workflow.basedir) / "workflow" / part) for part in ("", "scripts")]

from house.configuration import open_house
from house.digest import code_digest
from house.fingerprint import folder_fingerprint

try:
    HOUSE = open_house(config, source="config/config.yaml")
except ValueError as error:
    raise WorkflowError(str(error)) from None

RAW = HOUSE.paths["raw"]
RESULTS = HOUSE.paths["results"]
LAB = f"{RESULTS}/lab"
CAPTURE = RESULTS + "/{object}/{sensor}/{capture}"


def one_of(names):
    """Pattern of a wildcard that takes just the given names."""
    return "|".join(sorted(names)) or "none"


wildcard_constraints:
    object=one_of(HOUSE.objects),
    sensor=one_of(HOUSE.sensors),
    capture=r"[A-Za-z0-9]+(-a[0-9]+)?",
    point="[A-Za-z0-9]+",
    error="force_displacement|displacement",


def code(script):
    """Digest of the library modules that a script of the workflow imports."""
    return code_digest(Path(workflow.basedir) / "workflow" / "scripts" / f"{script}.py")


def content(folder):
    """Fingerprint of a dropped folder of captures; the lab's follow from its configuration."""

    def fingerprint(wildcards):
        if HOUSE.made_by_lab(wildcards.object):
            return "lab"
        return folder_fingerprint(folder.format(**wildcards))

    return fingerprint


def sensor_spec(wildcards):
    return HOUSE.sensors[wildcards.sensor]


def probe_spec(wildcards):
    return HOUSE.probe_of(wildcards.object)


def per_capture(pattern, **choices):
    """Files of all captures of the run; choices multiply them."""
    return [
        path
        for capture in HOUSE.captures
        for path in expand(
            pattern,
            object=capture.object,
            sensor=capture.sensor,
            capture=capture.capture,
            **choices,
        )
    ]


def lab_truths():
    """Truth of every capture that the lab makes."""
    return [f"{LAB}/{c.object}/{c.sensor}/{c.capture}/truth.npz" for c in sorted(HOUSE.simulated)]


def lab_materials():
    """True material of every object that the lab makes."""
    return [f"{LAB}/{name}/material.json" for name in sorted({c.object for c in HOUSE.simulated})]


def simulated_results():
    """What the accuracy tables compare with the truth."""
    names = ["mask.npz", "probe_pose.csv", "force.csv", "clouds.npz", "tracked.npz", "hertz.json"]
    names += [f"minimise-{error}.json" for error in config["error_options"]]
    return [
        f"{RESULTS}/{c.object}/{c.sensor}/{c.capture}/{name}"
        for c in sorted(HOUSE.simulated)
        for name in names
    ]


def lab_outputs():
    """Every capture that the lab is configured to make."""
    return [f"{RAW}/{c.object}/{c.sensor}/{c.capture}" for c in sorted(HOUSE.simulated)]


def study_outputs():
    """Tables, figures and summary of the run."""
    tables = [f"{RESULTS}/tables/{name}.csv" for name in ("table_5_2", "table_5_3")]
    figures = [
        f"{RESULTS}/figures/{name}.png"
        for name in ("figure_5_2", "figure_5_8", "figure_5_10", "tracked_surface")
    ]
    accuracy = [f"{RESULTS}/tables/pipeline_accuracy.csv"] if HOUSE.simulated else []
    return [*tables, *figures, *accuracy, f"{RESULTS}/summary.csv"]
