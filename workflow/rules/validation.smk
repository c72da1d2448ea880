# Palpate on other materials, shapes, depths and seeds than the study's: make validation.
rule validation:
    input:
        validation_outputs(),
    message:
        "The validation set is recorded, estimated and held against its truth"


rule validation_estimates:
    input:
        fits=per_capture(of_capture("hertz.json")),
        results=[],
        direct=per_capture(of_capture("direct.json")),
        joint=joint_estimates(),
    output:
        csv=results("validation_estimates.csv"),
    log:
        results("logs/validation_estimates.log"),
    benchmark:
        results("benchmarks/validation_estimates.tsv")
    params:
        code=code("summary"),
        captures=HOUSE.described(),
        tracked=[],
        estimated=HOUSE.described(),
        groups=direct_groups(),
        errors=[],
    message:
        "Estimates of every capture, without the error minimisation"
    script:
        "../scripts/summary.py"


rule validation_accuracy:
    input:
        summary=results("validation_estimates.csv"),
        materials=lab_materials(),
    output:
        csv=results("tables/validation.csv"),
        md=results("tables/validation.md"),
        summary=results("tables/validation_summary.csv"),
        summary_md=results("tables/validation_summary.md"),
    log:
        results("logs/validation_accuracy.log"),
    benchmark:
        results("benchmarks/validation_accuracy.tsv")
    params:
        code=code("accuracy"),
    message:
        "E and nu of materials that nothing was tuned on, against their truth"
    script:
        "../scripts/accuracy.py"
