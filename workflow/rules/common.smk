# Discovery, checks and paths shared by the rules. Nothing here computes a result.
import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError

sys.path[:0] = [
    str(Path(workflow.basedir) / "workflow" / part) for part in ("", "scripts")
]

from house.configuration import open_house
from house.digest import code_digest
from house.fingerprint import folder_fingerprint
from house.lab_checks import is_simulated
from palpate.capture.discover import CAPTURE_NAME

try:
    HOUSE = open_house(config, source="config/config.yaml")
except ValueError as error:
    raise WorkflowError(str(error)) from None

RAW = HOUSE.paths["raw"]
RESULTS = HOUSE.paths["results"]
LAB = f"{RESULTS}/lab"
KEPT_MESHES = Path(HOUSE.paths["meshes"])
ERRORS = config["error_options"]
LAB_OBJECTS = sorted({capture.object for capture in HOUSE.simulated})
# The lab can press all its objects, even those of whose names people dropped recordings.
MODELLED = sorted(HOUSE.lab["objects"]) if HOUSE.lab else []
SCANNED = [name for name in HOUSE.objects if HOUSE.template_source(name)[0] == "scans"]


def raw(path):
    return f"{RAW}/{path}"


def results(path):
    return f"{RESULTS}/{path}"


def truth(path):
    return f"{LAB}/{path}"


def of_capture(name):
    return results(f"{{object}}/{{sensor}}/{{capture}}/{name}")


def published(table):
    return f"config/published/{table}.csv"


def one_of(names):
    """Pattern of a wildcard that takes just the given names."""
    return "|".join(sorted(names)) or "none"


wildcard_constraints:
    object=one_of(HOUSE.objects),
    sensor=one_of(HOUSE.sensors),
    capture=CAPTURE_NAME.pattern,
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


def lab_spec(wildcards):
    """An object's block of lab.yaml, but for what is recorded of it."""
    spec = HOUSE.lab["objects"][wildcards.object]
    return {
        key: value for key, value in spec.items() if key not in ("recordings", "scan")
    }


def lab_common(wildcards):
    """What all films of the lab share."""
    apart = ("objects", "experiments", "simulated_block", "laser")
    return {key: value for key, value in HOUSE.lab.items() if key not in apart}


def lab_shape(wildcards):
    return HOUSE.lab["objects"][wildcards.object]["shape"]


def laser_spec(wildcards):
    """The laser scanner, its views of an object, and the seed."""
    scan = HOUSE.lab["objects"][wildcards.object]["scan"]
    return HOUSE.lab["laser"] | scan | {"seed": HOUSE.lab["seed"]}


def lab_probe(wildcards):
    """Probe with which the lab presses one of its objects."""
    return HOUSE.probes[HOUSE.lab["objects"][wildcards.object]["object"]["probe"]]


def lab_mechanics(wildcards):
    """What the mechanics of an object depend on."""
    spec = lab_spec(wildcards)
    return {key: spec[key] for key in ("shape", "material", "contact")} | {
        "points": spec["object"]["points"]
    }


def ladder_of(wildcards):
    """Mechanics of a capture's point; mirror images of a symmetric object share one."""
    point = HOUSE.lab_point(wildcards.object, wildcards.capture.split("-")[0])
    return truth(f"{wildcards.object}/contact-{point}.npz")


def experiment_spec(wildcards):
    """An experiment's block of lab.yaml, with the object's where it presses one."""
    options = HOUSE.lab["experiments"][Path(wildcards.recording).name]
    if "object" not in options:
        return options
    return options | {"spec": HOUSE.lab["objects"][options["object"]]}


def experiment_sensor(wildcards):
    return HOUSE.sensors[Path(wildcards.recording).parent.name]


def experiment_probe(wildcards):
    """Probe of an experiment, if it has one."""
    options = experiment_spec(wildcards)
    if "spec" in options:
        return HOUSE.probes[options["spec"]["object"]["probe"]]
    return HOUSE.probes[options["probe"]] if "probe" in options else None


def experiment_ladder(wildcards):
    """Mechanics of the point that an experiment presses, if it does."""
    options = experiment_spec(wildcards)
    if "spec" not in options:
        return []
    point = HOUSE.lab_point(options["object"], options["point"])
    return truth(f"{options['object']}/contact-{point}.npz")


def simulated_spec(wildcards):
    return HOUSE.lab["simulated_block"]


def simulated_mesh(wildcards):
    return HOUSE.lab["simulated_block"]["mesh"]


def template_of(wildcards):
    """An object's template: its own file, or the one made of its scans."""
    kind, name = HOUSE.template_source(wildcards.object)
    if kind == "file":
        return raw(f"{wildcards.object}/{name}")
    return results(f"{wildcards.object}/template.ply")


def scans_of(wildcards):
    _, name = HOUSE.template_source(wildcards.object)
    return raw(f"{wildcards.object}/{name}")


def scans_content(wildcards):
    """Fingerprint of dropped scans; the lab's follow from its configuration."""
    if HOUSE.made_by_lab(wildcards.object):
        return "lab"
    return folder_fingerprint(scans_of(wildcards))


def kept_mesh(wildcards):
    """The object's kept solid mesh where there is one (pytetwild never repeats itself)."""
    kept = KEPT_MESHES / f"{wildcards.object}.vtu"
    return str(kept) if kept.is_file() else []


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


def shown(figure):
    """Captures that a figure shows: for each sensor the study's point, or else the first."""
    block = config["study"]["block"]
    wanted = config["study"]["figure_points"].get(figure)
    every = HOUSE.described()
    ours = [capture for capture in every if capture["object"] == block] or every
    chosen = []
    for sensor in sorted({capture["sensor"] for capture in ours}):
        mine = [capture for capture in ours if capture["sensor"] == sensor]
        chosen.append(next((c for c in mine if c["capture"] == wanted), mine[0]))
    return chosen


def files_of(captures, name):
    """A file of each of the described captures."""
    return [
        f"{RESULTS}/{c['object']}/{c['sensor']}/{c['capture']}/{name}" for c in captures
    ]


def recordings_of(captures):
    """Folder of each of the described captures."""
    return [raw(f"{c['object']}/{c['sensor']}/{c['capture']}") for c in captures]


def seen_in(figure, pattern):
    """A result of the first capture that a figure shows."""
    return results(pattern.format(**shown(figure)[0]))


def seen_raw(figure, pattern):
    """A folder of the first capture that a figure shows."""
    return raw(pattern.format(**shown(figure)[0]))


def lab_truths():
    """Truth of every capture that the lab makes."""
    return [
        f"{LAB}/{c.object}/{c.sensor}/{c.capture}/truth.npz"
        for c in HOUSE.simulated_captures
    ]


def lab_materials():
    """True material of every object that the lab makes."""
    return [
        f"{LAB}/{name}/material.json"
        for name in sorted({c.object for c in HOUSE.simulated_captures})
    ]


def simulated_results():
    """What the accuracy tables compare with the truth."""
    names = [
        "mask.npz",
        "probe_pose.csv",
        "force.csv",
        "clock.json",
        "clouds.npz",
        "tracked.npz",
        "hertz.json",
    ]
    names += [f"minimise-{error}.json" for error in config["error_options"]]
    return [
        f"{RESULTS}/{c.object}/{c.sensor}/{c.capture}/{name}"
        for c in HOUSE.simulated_captures
        for name in names
    ]


def lab_outputs():
    """Everything that the lab writes into raw/."""
    made = HOUSE.simulated
    captures = {f"{RAW}/{c.object}/{c.sensor}/{c.capture}" for c in made}
    backgrounds = {f"{RAW}/{c.object}/{c.sensor}/background" for c in made}
    objects = {f"{RAW}/{c.object}/object.yaml" for c in made}
    scans = {f"{RAW}/{c.object}/scans" for c in made}
    objects |= {
        f"{RAW}/{name}/template.ply" for name in set(LAB_OBJECTS) - set(SCANNED)
    }
    return sorted(captures | backgrounds | objects | scans) + lab_experiments()


def lab_experiments():
    """Recordings about the sensors and simulations, where the lab is to make them."""
    if HOUSE.lab is None or config["only"] is not None:
        return []
    recordings = [f"{RAW}/sensors/{name}" for name in sorted(HOUSE.lab_experiments)]
    simulated = [f"{RAW}/simulations/foam_block.npz"]
    return recordings + (simulated if "simulated_block" in HOUSE.lab else [])


def sensors_of(experiment):
    """Sensors of which there is an experiment, the lab's or dropped."""
    done = {Path(name) for name in HOUSE.lab_experiments}
    made = {path.parent.name for path in done if path.name == experiment}
    dropped = {
        name
        for name in HOUSE.sensors
        if Path(RAW, "sensors", name, experiment).is_dir()
    }
    return sorted(made | dropped)


def sensor_files(experiment, name):
    """A file of each sensor of which there is an experiment."""
    return [f"{RESULTS}/sensors/{sensor}/{name}" for sensor in sensors_of(experiment)]


def raw_of_sensors(experiment):
    """Folders of an experiment."""
    return [f"{RAW}/sensors/{sensor}/{experiment}" for sensor in sensors_of(experiment)]


def experiment_content(experiment):
    """Fingerprint of a dropped experiment; the lab's follow from its configuration."""

    def fingerprint(wildcards):
        if f"{wildcards.sensor}/{experiment}" in HOUSE.lab_experiments:
            return "lab"
        return folder_fingerprint(f"{RAW}/sensors/{wildcards.sensor}/{experiment}")

    return fingerprint


def experiment_provenance(experiment):
    """Whether sensors' recordings of an experiment are simulated, by sensor."""
    return {
        sensor: "simulated"
        if f"{sensor}/{experiment}" in HOUSE.lab_experiments
        or is_simulated(f"{RAW}/sensors/{sensor}/{experiment}")
        else "recorded"
        for sensor in sensors_of(experiment)
    }


# What is made of each experiment about a sensor.
READINGS = {
    "calibration": "calibration.json",
    "workspace": "workspace.csv",
    "cd_case": "cd_case_path.csv",
    "loading": "loading.csv",
}


def read_experiments():
    """Sensors and names of the lab's experiments that are held against its truth."""
    pairs = [
        (Path(name).parent.name, Path(name).name) for name in HOUSE.lab_experiments
    ]
    return sorted(pair for pair in pairs if pair[1] in READINGS)


def seeing_outputs():
    """Tables and figures of Chapter 4, where their experiments are there."""
    made = {
        "calibration": ["tables/table_4_1.csv"],
        "workspace": ["tables/table_4_2.csv"],
        "cd_case": ["tables/cd_case.csv"],
        "loading": ["figures/figure_4_6.png"],
    }
    files = [file for name in made if sensors_of(name) for file in made[name]]
    accuracy = ["tables/sensor_accuracy.csv"] if read_experiments() else []
    return [f"{RESULTS}/{file}" for file in files + accuracy]


def experiments_probe(wildcards):
    """Probe of the recordings about the sensors."""
    return HOUSE.probes[config["experiments"]["probe"]]


def scanned_by_lab():
    """Objects of the lab whose templates come from its scans."""
    return sorted(set(LAB_OBJECTS) & set(SCANNED))


def first_truths(names):
    """Truth of one recording of each object, for its undeformed surface."""
    first = {c.object: c for c in sorted(HOUSE.simulated, reverse=True)}
    return [
        f"{LAB}/{name}/{first[name].sensor}/{first[name].capture}/truth.npz"
        for name in names
    ]


def fidelity_outputs():
    """The report on the lab's errors, where the lab makes all that it needs."""
    if not lab_experiments() or not all(
        sensors_of(name) for name in ("planes", "workspace", "loading")
    ):
        return []
    return [f"{RESULTS}/tables/lab_fidelity.csv"]


def study_outputs():
    """Tables, figures and summary of the run."""
    tables = [f"{RESULTS}/tables/{name}.csv" for name in ("table_5_2", "table_5_3")]
    figures = [
        f"{RESULTS}/figures/{name}.png"
        for name in ("figure_5_2", "figure_5_8", "figure_5_10", "tracked_surface")
    ]
    accuracy = (
        [f"{RESULTS}/tables/pipeline_accuracy.csv"] if HOUSE.simulated_captures else []
    )
    checks = [*accuracy, *fidelity_outputs()]
    if config["only"] is None:
        checks += seeing_outputs()
    figures += [f"{RESULTS}/figures/figure_4_{n}.png" for n in (11, 12)]
    return [*tables, *figures, *checks, f"{RESULTS}/summary.csv"]
