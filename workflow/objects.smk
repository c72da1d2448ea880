# Every object of raw/ as one job, which runs the ordinary workflow on it: docs/cluster.md.
from snakemake.utils import min_version

min_version("9.0")

import sys
from pathlib import Path

from snakemake.logging import logger

PROJECT = Path(workflow.current_basedir).parent
SCRIPTS = str(PROJECT / "workflow" / "scripts")
sys.path.insert(0, SCRIPTS)

from palpate.run.configuration import open_run
from palpate.run.digest import follow
from palpate.run.job_run import own_run
from palpate.run.lock import begin_run, last_holders
from palpate.run.many import ManyObjects
from palpate.run.pace import pace_of
from palpate.run.places import sources_of
from palpate.run.progress import GOES_ON, Plan, be_brief
from palpate.run.refusal import refuse, require_values
from thesis.options import Simulation

SOURCES = sources_of(PROJECT)
for source in SOURCES:

    configfile: source


own_run(SCRIPTS)
try:
    if workflow.is_main_process:
        require_values(workflow.config_settings.config)
    # What else it may be is refused by its schema.
    if isinstance(config.setdefault("paths", {}), dict):
        config["paths"]["lab"] = None
    RUN = open_run(
        config,
        sources=[*SOURCES, *map(str, workflow.overwrite_configfiles)],
        project=PROJECT,
        told=workflow.config_settings.config,
        files=False,
        blocks={"simulation": Simulation},
    )
except ValueError as error:
    refuse(error)

# From before the plan: it holds if nobody works here until the run begins.
LAST = last_holders(RUN.results("objects"))
MANY = ManyObjects(RUN)
PLAN = Plan(
    logger,
    begins=lambda: not workflow.dryrun and not workflow.execution_settings.no_hooks,
)


wildcard_constraints:
    object="[^/]+",


onstart:
    try:
        # Each object's own run holds that object's folder.
        begin_run(
            workflow.dag.jobs,
            workflow.dag.needrun_jobs(),
            results=RUN.results("objects"),
            raw=RUN.paths["raw"],
            seen=RUN.seen,
            last=LAST,
            shared=[RUN.paths["results"]],
            warn=logger.warning,
        )
    except ValueError as error:
        refuse(error)
    PLAN.show()
    PACE = pace_of(
        workflow.dag.needrun_jobs(),
        benchmarks=Path(RUN.results("benchmarks")),
        cores=workflow.resource_settings.cores,
    )
    be_brief(logger, len(workflow.dag), PACE)


onerror:
    logger.info(GOES_ON)


rule object_check:
    input:
        object=RUN.raw("{object}/object.yaml"),
    output:
        lines=MANY.of_object(".checked.txt"),
    log:
        RUN.results("logs/object_check/{object}.log"),
    benchmark:
        RUN.results("benchmarks/object_check/{object}.tsv")
    conda:
        "envs/palpate.yaml"
    resources:
        mem_mb=600,
        runtime=5,
    params:
        sensors=MANY.sensors,
        probes=MANY.probes,
    message:
        "Checking the captures of {wildcards.object}"
    script:
        "scripts/stages/object_check.py"


rule objects_checked:
    input:
        lines=MANY.each(".checked.txt"),
    output:
        summary=RUN.results("objects/checked.txt"),
    log:
        RUN.results("logs/objects_checked.log"),
    benchmark:
        RUN.results("benchmarks/objects_checked.tsv")
    localrule: True
    conda:
        "envs/palpate.yaml"
    message:
        "Nothing is wrong with any capture"
    script:
        "scripts/stages/objects_checked.py"


rule object_study:
    input:
        object=RUN.raw("{object}/object.yaml"),
        lines=MANY.of_object(".checked.txt"),
        checked=ancient(RUN.results("objects/checked.txt")),
    output:
        summary=MANY.of_object(".csv"),
    log:
        RUN.results("logs/object_study/{object}.log"),
    benchmark:
        RUN.results("benchmarks/object_study/{object}.tsv")
    conda:
        "envs/palpate.yaml"
    threads: 4
    resources:
        mem_mb=MANY.memory_mb,
        runtime=MANY.minutes,
    params:
        origin=MANY.origin,
        folder=MANY.of_object(""),
        wanted=MANY.wanted,
    message:
        "Object {wildcards.object}: all its captures"
    script:
        "scripts/stages/object_study.py"


rule objects_summary:
    input:
        summaries=MANY.each(".csv"),
    output:
        csv=RUN.results("objects.csv"),
    log:
        RUN.results("logs/objects_summary.log"),
    benchmark:
        RUN.results("benchmarks/objects_summary.tsv")
    localrule: True
    conda:
        "envs/palpate.yaml"
    message:
        "Summary of all objects"
    script:
        "scripts/stages/objects_summary.py"


rule all:
    default_target: True
    input:
        RUN.results("objects.csv"),
    localrule: True


follow(workflow.rules, MANY.content)
