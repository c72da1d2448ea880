# What holds for a run as a whole: nobody else works on its results, and a person sees it go on.
from snakemake.logging import logger

from house.progress import be_brief
from house.run_lock import begin_run


onstart:
    be_brief(logger, len(workflow.dag))
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
        raise WorkflowError(str(error)) from None
