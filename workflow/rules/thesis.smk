# Every table and figure of the thesis: a rule for each entry of thesis.artefacts.
from thesis.artefacts import in_run, wanted_of

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
        params:
            **entry.rule_params(RUN),
        message:
            entry.message
        script:
            "../scripts/stages/artefact.py"


# Drawn objects: make validation.
rule validation:
    input:
        [
            RUN.results("{object}/{sensor}/direct.json".format(**one))
            for one in RUN.groups()
        ],
    message:
        "All captures are recorded and estimated"


# What a run makes for its own sake: of one object nothing that is a run's of all.
WANTED = [
    *OWN.outputs(one.name for one in OWN_FIGURES),
    RUN.results("summary.csv"),
    RUN.results("pages/summary.html"),
    *([RUN.results("objects.html")] if RUN.tracked else []),
]
if RUN.config["only"] is None:
    WANTED += wanted_of(RUN)
    WANTED += [RUN.results("pages/configuration.html")]
