# The run that the rules share: what is on the way to it stands in palpate.workflow.
import os
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
from palpate.workflow.configuration import open_run
from palpate.workflow.digest import follow
from palpate.workflow.places import refuse, require_values, sources_of
from palpate.workflow.progress import GOES_ON
from palpate.workflow.run import one_of
from palpate.workflow.start import environment, start_run
from thesis.options import StudyConfig
from virtual_lab.checks import lab_problems
from virtual_lab.specification import Lab

os.environ |= environment(SCRIPTS)
SOURCES = sources_of(PROJECT)
for source in SOURCES:

    configfile: source


try:
    if workflow.is_main_process:
        require_values(workflow.config_settings.config)
    # Jobs on a cluster's nodes read the workflow again; captures were checked before the first.
    RUN = open_run(
        config,
        sources=[*SOURCES, *map(str, workflow.overwrite_configfiles)],
        project=PROJECT,
        told=workflow.config_settings.config,
        files=not workflow.remote_exec,
        lab_kind=Lab,
        check_lab=lab_problems,
        kind=StudyConfig,
        rules=workflow.rules,
    )
except ValueError as error:
    refuse(error)


wildcard_constraints:
    object=one_of(RUN.objects),
    sensor=one_of(RUN.sensors),
    capture=CAPTURE_NAME.pattern,
    point="[A-Za-z0-9]+",
    tracker=one_of(RUN.config["tracking"]["trackers"]),
    error="force_displacement|displacement",


onstart:
    start_run(workflow, RUN, logger)


onerror:
    logger.info(GOES_ON)
