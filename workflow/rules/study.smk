# Tables and figures, beside the published values; accuracy against the lab's truth.
rule table_5_3:
    input:
        results=[
            path
            for capture in table_5_3_captures()
            for error in ERRORS
            for path in files_of([capture], f"minimise-{error}.json")
        ],
        published=published("table_5_3"),
    output:
        csv=results("tables/table_5_3.csv"),
        md=results("tables/table_5_3.md"),
    log:
        results("logs/table_5_3.log"),
    benchmark:
        results("benchmarks/table_5_3.tsv")
    params:
        code=code("table_5_3"),
        captures=table_5_3_captures(),
        errors=ERRORS,
        name=config["study"]["block"],
        title="Table 5.3: E (Pa), nu and E* (Pa) of the block from error minimisation",
    message:
        "Table 5.3: E and nu of the block"
    script:
        "../scripts/table_5_3.py"


rule summary:
    input:
        fits=per_capture(of_capture("hertz.json")),
        results=per_tracked(of_capture("minimise-{error}.json"), error=ERRORS),
        direct=per_direct(of_capture("direct.json")),
        joint=joint_estimates(),
    output:
        csv=results("summary.csv"),
    log:
        results("logs/summary.log"),
    benchmark:
        results("benchmarks/summary.tsv")
    params:
        code=code("summary"),
        captures=HOUSE.described(),
        tracked=HOUSE.described(tracked=True),
        estimated=HOUSE.described(direct=True),
        groups=direct_groups(),
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
        csv=results("tables/pipeline_accuracy.csv"),
        md=results("tables/pipeline_accuracy.md"),
    log:
        results("logs/pipeline_accuracy.log"),
    benchmark:
        results("benchmarks/pipeline_accuracy.tsv")
    params:
        code=code("pipeline_accuracy"),
        captures=HOUSE.described(simulated=True, tracked=True),
        errors=ERRORS,
        tracker=TRACKER,
    message:
        "Accuracy against the lab's truth"
    script:
        "../scripts/pipeline_accuracy.py"


rule tracking_accuracy:
    input:
        truths=lab_truths(),
        tracked=compared_results("{object}/{sensor}/{capture}/tracked-{tracker}.npz"),
        seconds=compared_results(
            "benchmarks/track/{object}-{sensor}-{capture}-{tracker}.tsv"
        ),
    output:
        csv=results("tables/tracking_accuracy.csv"),
        md=results("tables/tracking_accuracy.md"),
    log:
        results("logs/tracking_accuracy.log"),
    benchmark:
        results("benchmarks/tracking_accuracy.tsv")
    params:
        code=code("tracking_accuracy"),
        captures=HOUSE.described(simulated=True, tracked=True),
        trackers=config["tracking"]["compared"],
    message:
        "Accuracy of the trackers against the lab's truth"
    script:
        "../scripts/tracking_accuracy.py"


rule figure_5_8:
    input:
        results=files_of(shown("figure_5_8"), f"minimise-{ERRORS[0]}.json"),
    output:
        png=captioned(results("figures/figure_5_8.png")),
        svg=results("figures/figure_5_8.svg"),
    log:
        results("logs/figure_5_8.log"),
    benchmark:
        results("benchmarks/figure_5_8.tsv")
    params:
        code=code("figure_5_8"),
        captures=shown("figure_5_8"),
        error=ERRORS[0],
    message:
        "Figure 5.8: minimisation"
    script:
        "../scripts/figure_5_8.py"


rule figure_5_10:
    input:
        mismatches=files_of(shown("figure_5_10"), f"mismatch-{ERRORS[0]}.vtu"),
        tracked=files_of(shown("figure_5_10"), f"tracked-{TRACKER}.npz"),
    output:
        png=captioned(results("figures/figure_5_10.png")),
        svg=results("figures/figure_5_10.svg"),
    log:
        results("logs/figure_5_10.log"),
    benchmark:
        results("benchmarks/figure_5_10.tsv")
    params:
        code=code("figure_5_10"),
        captures=shown("figure_5_10"),
    message:
        "Figure 5.10: mismatch"
    script:
        "../scripts/figure_5_10.py"


rule tracked_surface:
    input:
        tracked=files_of(shown("tracked_surface"), f"tracked-{TRACKER}.npz"),
        clouds=files_of(shown("tracked_surface"), "clouds.npz"),
        fits=files_of(shown("tracked_surface"), "hertz.json"),
        recorded=recordings_of(shown("tracked_surface")),
    output:
        png=captioned(results("figures/tracked_surface.png")),
        svg=results("figures/tracked_surface.svg"),
    log:
        results("logs/tracked_surface.log"),
    benchmark:
        results("benchmarks/tracked_surface.tsv")
    params:
        code=code("tracked_surface"),
        captures=shown("tracked_surface"),
        sensors=[HOUSE.sensors[c["sensor"]] for c in shown("tracked_surface")],
    message:
        "Tracked surfaces"
    script:
        "../scripts/tracked_surface.py"
