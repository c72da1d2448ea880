# The study's error minimisation with one change after the other, against the lab's truth.
rule minimise_steps:
    input:
        object=raw("{object}/object.yaml"),
        solid=results("{object}/solid.vtu"),
        tracked=[of_capture(f"tracked-{name}.npz") for name in stepped_trackers()],
        force=of_capture("force.csv"),
        fit=of_capture("hertz.json"),
        truth=truth("{object}/{sensor}/{capture}/truth.npz"),
    output:
        result=of_capture("minimise_steps.json"),
    log:
        results("logs/minimise_steps/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/minimise_steps/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("minimise_steps"),
        probe=probe_spec,
        solid=config["solid"],
        options=load_and_search,
        steps=minimise_steps(),
        tracker=TRACKER,
        trackers=stepped_trackers(),
        errors=ERRORS,
    message:
        "Steps of the error minimisation of {wildcards.object}, {wildcards.sensor}, "
        "{wildcards.capture}"
    script:
        "../scripts/minimise_steps.py"


rule minimise_steps_table:
    input:
        results=files_of(stepped_captures(), "minimise_steps.json"),
        materials=lab_materials(),
    output:
        csv=results("tables/minimise_steps.csv"),
        md=results("tables/minimise_steps.md"),
        png=captioned(results("figures/minimise_steps.png")),
        svg=results("figures/minimise_steps.svg"),
    log:
        results("logs/minimise_steps_table.log"),
    benchmark:
        results("benchmarks/minimise_steps_table.tsv")
    params:
        code=code("minimise_steps_table"),
        captures=stepped_captures(),
        shown=ERRORS[-1],
    message:
        "What each step of the error minimisation changes"
    script:
        "../scripts/minimise_steps_table.py"
