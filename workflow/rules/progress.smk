# What a person sees while the run goes on.
from snakemake.logging import logger

from house.progress import be_brief


onstart:
    be_brief(logger, len(workflow.dag))
