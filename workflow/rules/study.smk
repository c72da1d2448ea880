# Tables and figures, beside the published values; accuracy against the lab's truth.
ERRORS = config["error_options"]


def published(table):
    return f"config/published/{table}.csv"


rule table_5_2:
    input:
        fits=per_capture(CAPTURE + "/hertz.json"),
        published=published("table_5_2"),
    output:
        csv=RESULTS + "/tables/table_5_2.csv",
        md=RESULTS + "/tables/table_5_2.md",
    log:
        RESULTS + "/logs/table_5_2.log",
    benchmark:
        RESULTS + "/benchmarks/table_5_2.tsv"
    params:
        code=code("table_5_2"),
        captures=HOUSE.described(),
        block=config["study"]["block"],
    message:
        "Table 5.2: reduced modulus of the block"
    script:
        "../scripts/table_5_2.py"


rule table_5_3:
    input:
        fits=per_capture(CAPTURE + "/hertz.json"),
        results=per_capture(CAPTURE + "/minimise-{error}.json", error=ERRORS),
        published=published("table_5_3"),
    output:
        csv=RESULTS + "/tables/table_5_3.csv",
        md=RESULTS + "/tables/table_5_3.md",
    log:
        RESULTS + "/logs/table_5_3.log",
    benchmark:
        RESULTS + "/benchmarks/table_5_3.tsv"
    params:
        code=code("table_5_3"),
        captures=HOUSE.described(),
        errors=ERRORS,
        block=config["study"]["block"],
    message:
        "Table 5.3: E and nu of the block"
    script:
        "../scripts/table_5_3.py"


rule summary:
    input:
        fits=per_capture(CAPTURE + "/hertz.json"),
        results=per_capture(CAPTURE + "/minimise-{error}.json", error=ERRORS),
    output:
        csv=RESULTS + "/summary.csv",
    log:
        RESULTS + "/logs/summary.log",
    benchmark:
        RESULTS + "/benchmarks/summary.tsv"
    params:
        code=code("summary"),
        captures=HOUSE.described(),
        errors=ERRORS,
    message:
        "Summary: every object, sensor, capture and method"
    script:
        "../scripts/summary.py"


rule pipeline_accuracy:
    input:
        truths=lab_truths(),
        materials=lab_materials(),
        results=simulated_results(),
    output:
        csv=RESULTS + "/tables/pipeline_accuracy.csv",
        md=RESULTS + "/tables/pipeline_accuracy.md",
    log:
        RESULTS + "/logs/pipeline_accuracy.log",
    benchmark:
        RESULTS + "/benchmarks/pipeline_accuracy.tsv"
    params:
        code=code("pipeline_accuracy"),
        captures=HOUSE.described(simulated=True),
        errors=ERRORS,
        results_folder=RESULTS,
    message:
        "Accuracy against the lab's truth"
    script:
        "../scripts/pipeline_accuracy.py"
