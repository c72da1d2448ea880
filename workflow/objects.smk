# Every object of raw/ as one job, which runs the ordinary workflow on it: docs/cluster.md.
from snakemake.utils import min_version

min_version("9.0")


include: "rules/objects.smk"


rule all:
    default_target: True
    input:
        RUN.results("objects.csv"),
    localrule: True
