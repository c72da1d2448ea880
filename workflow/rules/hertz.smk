# Section 5.1: the Hertz model and its tables.
rule hertz:
    input:
        object=raw("{object}/object.yaml"),
        template=template_of,
        alignment=of_capture("alignment.json"),
        pose=of_capture("probe_pose.csv"),
        force=of_capture("force.csv"),
    output:
        fit=of_capture("hertz.json"),
    log:
        results("logs/hertz/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/hertz/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("hertz"),
        probe=probe_spec,
        options=config["hertz"],
    message:
        "Hertz fit of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/hertz.py"


rule table_5_1:
    input:
        fits=files_of(attempts(), "hertz.json"),
        published=published("table_5_1"),
    output:
        csv=results("tables/table_5_1.csv"),
        md=results("tables/table_5_1.md"),
    log:
        results("logs/table_5_1.log"),
    benchmark:
        results("benchmarks/table_5_1.tsv")
    params:
        code=code("table_5_1"),
        captures=attempts(),
    message:
        "Table 5.1: repeated presses of one point"
    script:
        "../scripts/table_5_1.py"


rule table_5_2:
    input:
        fits=per_capture(of_capture("hertz.json")),
        published=published("table_5_2"),
    output:
        csv=results("tables/table_5_2.csv"),
        md=results("tables/table_5_2.md"),
        pattern=results("tables/table_5_2_pattern.csv"),
    log:
        results("logs/table_5_2.log"),
    benchmark:
        results("benchmarks/table_5_2.tsv")
    params:
        code=code("table_5_2"),
        captures=HOUSE.described(),
        block=config["study"]["block"],
    message:
        "Table 5.2: reduced modulus of the block"
    script:
        "../scripts/table_5_2.py"


rule hertz_accuracy:
    input:
        fits=files_of(HOUSE.described(simulated=True), "hertz.json"),
        materials=lab_materials(),
    output:
        csv=results("tables/hertz_accuracy.csv"),
        md=results("tables/hertz_accuracy.md"),
        summary=results("tables/hertz_accuracy_summary.csv"),
    log:
        results("logs/hertz_accuracy.log"),
    benchmark:
        results("benchmarks/hertz_accuracy.tsv")
    params:
        code=code("hertz_accuracy"),
        captures=HOUSE.described(simulated=True),
    message:
        "Hertz models against the lab's truth"
    script:
        "../scripts/hertz_accuracy.py"
