# What holds for a run as a whole: nobody else works on its results, and a person sees it go on.
from snakemake.logging import logger

from house.progress import GOES_ON, Plan, be_brief
from house.run_lock import begin_run

PLAN = Plan(logger, begins=run_begins)


onstart:
    try:
        begin_run(
            workflow.dag.jobs,
            workflow.dag.needrun_jobs(),
            results=RESULTS,
            raw=RAW,
            seen=HOUSE.seen,
            warn=logger.warning,
        )
    except ValueError as error:
        refuse(error)
    if workflow.local_exec:
        # With a rate limit each pass of the scheduler starts a clock that makes another pass.
        workflow.scheduler.job_rate_limiter = None
    PLAN.show()
    be_brief(logger, len(workflow.dag))


onerror:
    logger.info(GOES_ON)
