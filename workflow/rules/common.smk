# The run that the rules share: what is on the way to it stands in palpate.run.
import shutil
import subprocess
import sys
from pathlib import Path

from snakemake.logging import logger

BASE = workflow.current_basedir
# Named in a repository (github(...), git+file:) the workflow has no folder: its commit gets one.
if hasattr(BASE, "ref"):
    CLONE = str(getattr(BASE, "repo_path", None) or BASE.hosted_repo.repo_clone)
    GIT = ["git", "-C", CLONE]
    COMMIT = subprocess.check_output([*GIT, "rev-parse", BASE.ref], text=True).strip()
    PROJECT = Path(".snakemake", "palpate", COMMIT).absolute()
    if not PROJECT.is_dir():
        PROJECT.parent.mkdir(parents=True, exist_ok=True)
        subprocess.run([*GIT, "archive", "-o", f"{PROJECT}.tar", COMMIT], check=True)
        shutil.unpack_archive(f"{PROJECT}.tar", f"{PROJECT}.part", filter="data")
        Path(f"{PROJECT}.part").rename(PROJECT)
else:
    PROJECT = Path(BASE).parent.parent
CAPTION = str(PROJECT / "workflow" / "report" / "caption.rst")
SCRIPTS = str(PROJECT / "workflow" / "scripts")
sys.path.insert(0, SCRIPTS)

from palpate.capture.discover import CAPTURE_NAME
from palpate.run.configuration import open_run
from palpate.run.digest import follow
from palpate.run.job_run import own_run
from palpate.run.lock import begin_run, last_holders
from palpate.run.pace import pace_of
from palpate.run.places import sources_of
from palpate.run.progress import GOES_ON, Plan, be_brief
from palpate.run.refusal import look_first, refuse
from palpate.run.run import one_of
from thesis.options import Simulation
from virtual_lab.checks import lab_problems

SOURCES = sources_of(PROJECT)
for source in SOURCES:

    configfile: source


own_run(SCRIPTS)
try:
    if workflow.is_main_process:
        look_first(config, workflow.config_settings.config, warn=logger.warning)
    # Jobs on a cluster's nodes read the workflow again; captures were checked before the first.
    RUN = open_run(
        config,
        sources=[*SOURCES, *map(str, workflow.overwrite_configfiles)],
        project=PROJECT,
        told=workflow.config_settings.config,
        files=not workflow.remote_exec,
        check_lab=lab_problems,
        blocks={"simulation": Simulation},
        rules=workflow.rules,
        later=True,
    )
except ValueError as error:
    refuse(error)
# From before the plan: it holds if nobody works here until the run begins.
LAST = last_holders(RUN.paths["results"], RUN.paths["raw"])


wildcard_constraints:
    object=one_of(RUN.objects),
    sensor=one_of(RUN.sensors),
    capture=CAPTURE_NAME.pattern,
    point="[A-Za-z0-9]+",
    tracker=one_of(RUN.config["tracking"]["trackers"]),
    error="force_displacement|displacement",


# Whether this Snakemake begins a run (onstart), and doesn't just look or do one job of one.
PLAN = Plan(
    logger,
    begins=lambda: not workflow.dryrun and not workflow.execution_settings.no_hooks,
)


onstart:
    try:
        begin_run(
            workflow.dag.jobs,
            workflow.dag.needrun_jobs(),
            results=RUN.paths["results"],
            raw=RUN.paths["raw"],
            seen=RUN.seen,
            last=LAST,
            warn=logger.warning,
        )
    except ValueError as error:
        refuse(error)
    if workflow.local_exec:
        # With a rate limit each pass of the scheduler starts a clock that makes another: decisions.md.
        workflow.scheduler.job_rate_limiter = None
    PLAN.show()
    PACE = pace_of(
        workflow.dag.needrun_jobs(),
        benchmarks=Path(RUN.results("benchmarks")),
        cores=workflow.resource_settings.cores,
    )
    be_brief(logger, len(workflow.dag), PACE)


onerror:
    logger.info(GOES_ON)
