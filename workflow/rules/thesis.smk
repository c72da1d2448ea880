# Every table and figure of the thesis: a rule for each entry of thesis.artefacts.
from thesis.artefacts import in_run, wanted_of
from thesis.selections import objects_shown

for entry in in_run(RUN):

    rule:
        name:
            entry.name
        input:
            **entry.rule_inputs(RUN),
        output:
            **entry.reported(RUN, report, CAPTION),
        log:
            RUN.results(f"logs/{entry.log}.log"),
        benchmark:
            RUN.results(f"benchmarks/{entry.log}.tsv")
        wildcard_constraints:
            **entry.wildcards,
        priority: entry.priority
        localrule: entry.local
        conda:
            "../envs/palpate.yaml"
        params:
            **entry.rule_params(RUN),
        message:
            entry.message
        script:
            "../scripts/stages/artefact.py"


# Other materials, shapes, depths and seeds than the study's: make validation.
rule validation_estimates:
    input:
        fits=RUN.files(RUN.described(), "hertz.json"),
        results=[],
        direct=RUN.files(RUN.described(), "direct.json"),
        joint=RUN.joint_estimates(),
        curves=[],
    output:
        csv=RUN.results("validation_estimates.csv"),
    log:
        RUN.results("logs/validation_estimates.log"),
    benchmark:
        RUN.results("benchmarks/validation_estimates.tsv")
    conda:
        "../envs/palpate.yaml"
    params:
        captures=RUN.described(),
        minimised=[],
        estimated=RUN.described(),
        groups=RUN.groups(),
        curves=[],
        errors=[],
    message:
        "Estimates of every capture, without the error minimisation"
    script:
        "../scripts/stages/summary.py"


rule validation:
    input:
        [RUN.results(f"tables/validation{part}.csv") for part in ("", "_summary")],
    message:
        "The validation set is recorded, estimated and held against its truth"


# What a run makes for its own sake: of one object nothing that is a run's of all.
WANTED = [
    *OWN.outputs(),
    RUN.results("summary.csv"),
    RUN.results("pages/summary.html"),
    *([RUN.results("objects.html")] if RUN.tracked else []),
]
if RUN.config["only"] is None:
    WANTED += wanted_of(RUN, of_sensors=OWN.alone)
    WANTED += [RUN.results("pages/configuration.html"), RUN.results("wanted.txt")]
