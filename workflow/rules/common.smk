# Discovery, checks and paths shared by the rules. Nothing here computes a result.
import sys
from functools import cache
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.logging import logger

sys.path[:0] = [
    str(Path(workflow.basedir) / "workflow" / part) for part in ("", "scripts")
]

from house.configuration import open_house
from house.digest import code_digest
from house.lab_checks import is_simulated
from house.objects import BALL, EAR, studied, too_many
from house.refusal import refuse, require_values
from house.trackers import options_of
from job_run import own_run
from palpate.capture.discover import CAPTURE_NAME
from palpate.capture.fingerprint import folder_fingerprint

if workflow.is_main_process and (words := too_many(config)):
    logger.warning(words)
own_run()
try:
    if workflow.is_main_process:
        require_values(workflow.config_settings.config)
    # Jobs on a cluster's nodes read the workflow again; captures were checked before the first.
    HOUSE = open_house(
        config, source="config/config.yaml", files=not workflow.remote_exec
    )
except ValueError as error:
    refuse(error)

RAW = HOUSE.paths["raw"]
RESULTS = HOUSE.paths["results"]
LAB = f"{RESULTS}/lab"
KEPT_MESHES = Path(HOUSE.paths["meshes"])
ERRORS = config["error_options"]
# Whose surfaces the estimates are made from.
TRACKER = config["tracking"]["estimate_from"]
LAB_OBJECTS = sorted({capture.object for capture in HOUSE.simulated})
# The lab can press all its objects, even those of whose names people dropped recordings.
MODELLED = sorted(HOUSE.lab["objects"]) if HOUSE.lab else []
DIRECT = {(c.object, c.sensor, c.capture) for c in HOUSE.direct}
SCANNED = [name for name in HOUSE.objects if HOUSE.template_source(name)[0] == "scans"]


def run_begins():
    """Whether this Snakemake begins a run (onstart), and doesn't just look or do one job of one."""
    return not workflow.dryrun and not workflow.execution_settings.no_hooks


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
    tracker=one_of(config["tracking"]["trackers"]),
    error="force_displacement|displacement",


def code(script):
    """Digest of the library modules that a script of the workflow imports."""
    return code_digest(Path(workflow.basedir) / "workflow" / "scripts" / f"{script}.py")


# Several rules read the same folder; while the workflow is read it does not change.
_fingerprint = cache(folder_fingerprint)


def fingerprint_of(folder):
    """Fingerprint of a dropped folder, as it was before the checks."""
    return HOUSE.seen.get(str(Path(folder))) or _fingerprint(str(folder))


def content(folder):
    """Fingerprint of a dropped folder of captures; the lab's follow from its configuration."""

    def fingerprint(wildcards):
        if HOUSE.made_by_lab(wildcards.object):
            return "lab"
        return fingerprint_of(folder.format(**wildcards))

    return fingerprint


def sensor_spec(wildcards):
    return HOUSE.sensors[wildcards.sensor]


def probe_spec(wildcards):
    return HOUSE.probe_of(wildcards.object)


def tracker_options(wildcards):
    """Options of a tracker for an object."""
    return options_of(config["tracking"], wildcards.tracker, wildcards.object)


# Of the error minimisation, without what single objects and the table of steps have of their own.
SEARCH = {k: v for k, v in config["minimise"].items() if k not in ("objects", "steps")}


def load_and_search(wildcards):
    """Options of the error minimisation for an object."""
    return SEARCH | config["minimise"]["objects"].get(wildcards.object, {})


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
    return fingerprint_of(scans_of(wildcards))


def kept_mesh(wildcards):
    """The object's kept solid mesh where there is one (pytetwild never repeats itself)."""
    kept = KEPT_MESHES / f"{wildcards.object}.vtu"
    return str(kept) if kept.is_file() else []


def first_cloud_of(wildcards):
    """Clouds that begin with a capture's first; of others than Hertz's all are made anyway."""
    name = "clouds.npz" if tuple(wildcards) in DIRECT else "rest_cloud.npz"
    return of_capture(name)


def per_capture(pattern):
    """Files of all captures of the run."""
    return _expanded(pattern, HOUSE.captures)


def per_tracked(pattern, **choices):
    """Files of the captures whose surfaces are tracked; choices multiply them."""
    return _expanded(pattern, HOUSE.tracked, **choices)


def per_direct(pattern):
    """Files of the captures that are estimated directly."""
    return _expanded(pattern, HOUSE.direct)


def _expanded(pattern, captures, **choices):
    return [
        path
        for capture in captures
        for path in expand(
            pattern,
            object=capture.object,
            sensor=capture.sensor,
            capture=capture.capture,
            **choices,
        )
    ]


# Figures that need no tracked surface, and so may show any capture.
UNTRACKED_FIGURES = {"figure_5_2"}


def shown(figure):
    """Captures that a figure shows: for each sensor the study's point, or else the first."""
    block = config["study"]["block"]
    wanted = config["study"]["figure_points"].get(figure)
    every = HOUSE.described(tracked=figure not in UNTRACKED_FIGURES)
    ours = [capture for capture in every if capture["object"] == block] or every
    chosen = []
    for sensor in sorted({capture["sensor"] for capture in ours}):
        mine = [capture for capture in ours if capture["sensor"] == sensor]
        chosen.append(next((c for c in mine if c["capture"] == wanted), mine[0]))
    return chosen


def table_5_3_captures():
    """The study's points of its block; of dropped captures all of the block."""
    wanted = config["study"]["table_5_3_points"]
    return [
        capture
        for capture in HOUSE.described(tracked=True)
        if capture["object"] == config["study"]["block"]
        and (capture["point"] in wanted or capture["provenance"] != "simulated")
    ]


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


def fidelity_outputs():
    """The report on the lab's errors, where the lab makes all that it needs."""
    if not lab_experiments() or not all(
        sensors_of(name) for name in ("planes", "workspace", "loading")
    ):
        return []
    return [f"{RESULTS}/tables/lab_fidelity.csv"]


def diagrams():
    """Numbers of the diagrams of Section 4.2 that the study's block can be shown in."""
    block = config["study"]["block"]
    if block not in {capture.object for capture in HOUSE.tracked}:
        return []
    grey = (
        HOUSE.sensors[shown("figure_4_11")[0]["sensor"]]["color"]["encoding"] == "mono8"
    )
    return [12] if grey else [11, 12]


def study_outputs():
    """Tables, figures and summary of the run, and the pages made from them."""
    outputs = tables_and_figures()
    return with_report(outputs) + second_forms(outputs) + own_outputs()


def second_forms(outputs):
    """A figure's vector drawing and a table's Markdown, so that these too are made anew if lost."""
    drawings = [p.removesuffix(".png") + ".svg" for p in outputs if p.endswith(".png")]
    texts = [p.removesuffix(".csv") + ".md" for p in outputs if "/tables/" in p]
    return drawings + texts


def tables_and_figures():
    """Tables, figures and summary of the run; of people's own objects see own_outputs."""
    if all_own():
        return [*own_sensor_outputs(), results("summary.csv")]
    tables, figures, accuracy = [], ["figure_5_2"], []
    if table_5_3_captures():
        tables = [f"{RESULTS}/tables/table_5_3.csv"]
    if HOUSE.tracked:
        figures += ["figure_5_8", "figure_5_10", "tracked_surface", "poisson_profiles"]
        figures += ["direct_moduli"]
    figures = [f"{RESULTS}/figures/{name}.png" for name in figures]
    if HOUSE.described(simulated=True, tracked=True):
        names = ["pipeline_accuracy", "tracking_accuracy", "minimise_steps"]
        accuracy = [f"{RESULTS}/tables/{name}.csv" for name in names]
    checks = [*accuracy, *fidelity_outputs()]
    if config["only"] is None:
        checks += seeing_outputs()
    figures += [f"{RESULTS}/figures/figure_4_{n}.png" for n in diagrams()]
    figures += hertz_figure_outputs() + diagram_outputs() + tracking_figure_outputs()
    figures += rig_outputs() + minimise_steps_figures()
    tables += hertz_outputs() + simulation_outputs() + direct_outputs()
    tables += estimate_outputs() + comparison_outputs()
    return [*tables, *figures, *checks, f"{RESULTS}/summary.csv"]
