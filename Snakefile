# Palpate, from the project's own folder; workflow/Snakefile has all.
include: "workflow/Snakefile"


# What is included has no say in what a bare `snakemake` makes.
workflow.default_target = "all"
