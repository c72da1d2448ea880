# What the rules that take each object as one job share.
import sys
from functools import cache
from pathlib import Path

from snakemake.logging import logger

PROJECT = Path(workflow.basedir).parent
sys.path[:0] = [str(PROJECT / "workflow" / part) for part in ("", "scripts")]

from house.configuration import open_house
from house.digest import code_digest
from palpate.capture.fingerprint import folder_fingerprint
from house.objects import kept_files, project_digest, studied, value_digest
from house.progress import GOES_ON, Plan, be_brief
from house.refusal import refuse, require_values
from house.run_lock import begin_run
from job_run import own_run
from object_config import object_config

own_run()
try:
    if workflow.is_main_process:
        require_values(workflow.config_settings.config)
    # What else it may be is refused by its schema.
    if isinstance(config["paths"], dict):
        config["paths"]["lab"] = None
    HOUSE = open_house(config, source="config/config.yaml", files=False)
except ValueError as error:
    refuse(error)

RAW = HOUSE.paths["raw"]
RESULTS = HOUSE.paths["results"]
STUDIED = studied(config)
DIGEST = project_digest(PROJECT)


wildcard_constraints:
    object="[^/]+",


def of_object(name):
    return f"{RESULTS}/objects/{{object}}{name}"


def wanted(wildcards):
    """What an object's run makes; its configuration makes the rest where somebody wants it."""
    if wildcards.object in STUDIED:
        return [
            "summary.csv",
            "figures/direct_moduli.png",
            "figures/tracked_surface.png",
        ]
    return ["summary.csv", f"{wildcards.object}/report.html"]


def run_begins():
    """Whether this Snakemake begins a run (onstart), and doesn't just look or do one job of one."""
    return not workflow.dryrun and not workflow.execution_settings.no_hooks


def begin_objects():
    """Hold what this run writes into; each object's own run holds that object's folder."""
    begin_run(
        workflow.dag.jobs,
        workflow.dag.needrun_jobs(),
        results=f"{RESULTS}/objects",
        raw=RAW,
        seen=HOUSE.seen,
        warn=logger.warning,
    )


def per_object(pattern):
    """A file of each object."""
    return expand(pattern, object=HOUSE.objects)


def code(script):
    """Digest of the library modules that a script of the workflow imports."""
    return code_digest(PROJECT / "workflow" / "scripts" / f"{script}.py")


def sensor_specs(wildcards):
    names = sorted({capture.sensor for capture in _captures()[wildcards.object]})
    return {name: HOUSE.sensors[name] for name in names}


def probe_specs(wildcards):
    name = HOUSE.object_files[wildcards.object]["probe"]
    return {name: HOUSE.probes[name]}


@cache
def _captures():
    """Captures of each object."""
    found = {name: [] for name in HOUSE.objects}
    for capture in HOUSE.captures:
        found[capture.object].append(capture)
    return found


def content(wildcards):
    """Fingerprint of all that was dropped for an object."""
    return _fingerprint(f"{RAW}/{wildcards.object}")


_fingerprint = cache(folder_fingerprint)


def origin(wildcards):
    """Digest of what an object's results follow from, beside its captures."""
    sensors, name = sensor_specs(wildcards), wildcards.object
    options = object_config(config, name, of_object("").format(object=name))
    kept = kept_files(name, sensors, HOUSE.paths)
    return value_digest([DIGEST, options, sensors, probe_specs(wildcards), kept])


# Of one core: what the largest job of an object's takes, see workflow/profiles/slurm.
CORE_MB = 1600
# On one core that has nothing else to do, with a margin of two (docs/cluster.md).
LOOKUP_MINUTES, CAPTURE_MINUTES, BASE_MINUTES = 6, 3, 10


def memory(wildcards, threads, attempt):
    return CORE_MB * threads * 2 ** (attempt - 1)


def minutes(wildcards, threads, attempt):
    """Time of an object: a look-up of each point, and a film of each capture."""
    captures = _captures()[wildcards.object]
    work = CAPTURE_MINUTES * len(captures)
    work += LOOKUP_MINUTES * len({capture.point for capture in captures})
    return int(BASE_MINUTES + work / threads) * 2 ** (attempt - 1)
