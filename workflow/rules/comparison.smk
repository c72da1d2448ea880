# Tables 5.3 to 5.5, figures of the minimisations, and the study's numbers and findings beside ours.
rule table_5_3_all:
    input:
        results=minima_of(all_tracked_of(config["study"]["block"])),
        material=material_of(config["study"]["block"]),
        published=published("table_5_3"),
    output:
        csv=results("tables/table_5_3_all.csv"),
        md=results("tables/table_5_3_all.md"),
    log:
        results("logs/table_5_3_all.log"),
    benchmark:
        results("benchmarks/table_5_3_all.tsv")
    params:
        code=code("table_5_3"),
        captures=all_tracked_of(config["study"]["block"]),
        errors=ERRORS,
        name=config["study"]["block"],
        title="Table 5.3 for all points: E (Pa), nu and E* (Pa) of the block",
    message:
        "Table 5.3 for all points of the block"
    script:
        "../scripts/table_5_3.py"


rule table_5_4:
    input:
        results=minima_of(all_tracked_of(BALL)),
        material=material_of(BALL),
        published=published("table_5_4"),
    output:
        csv=results("tables/table_5_4.csv"),
        md=results("tables/table_5_4.md"),
    log:
        results("logs/table_5_4.log"),
    benchmark:
        results("benchmarks/table_5_4.tsv")
    params:
        code=code("table_5_3"),
        captures=all_tracked_of(BALL),
        errors=ERRORS,
        name=BALL,
        title="Table 5.4: E (Pa) and nu of the ball from error minimisation",
    message:
        "Table 5.4: E and nu of the ball"
    script:
        "../scripts/table_5_3.py"


rule table_5_5:
    input:
        results=minima_of(all_tracked_of(EAR)),
        material=material_of(EAR),
        published=published("table_5_5"),
    output:
        csv=results("tables/table_5_5.csv"),
        md=results("tables/table_5_5.md"),
    log:
        results("logs/table_5_5.log"),
    benchmark:
        results("benchmarks/table_5_5.tsv")
    params:
        code=code("table_5_3"),
        captures=all_tracked_of(EAR),
        errors=ERRORS,
        name=EAR,
        title="Table 5.5: E (Pa) and nu of the ear from error minimisation",
    message:
        "Table 5.5: E and nu of the ear"
    script:
        "../scripts/table_5_3.py"


rule figure_5_9:
    input:
        results=files_of(shown("figure_5_8"), f"minimise-{ERRORS[0]}.json"),
    output:
        png=captioned(results("figures/figure_5_9.png")),
        svg=results("figures/figure_5_9.svg"),
    log:
        results("logs/figure_5_9.log"),
    benchmark:
        results("benchmarks/figure_5_9.tsv")
    params:
        code=code("figure_5_8"),
        captures=shown("figure_5_8"),
        error=ERRORS[0],
        iterations=FIRST_ITERATIONS,
    message:
        "Figure 5.9: first iterations of Figure 5.8"
    script:
        "../scripts/figure_5_8.py"


rule figure_5_14:
    input:
        results=files_of(tracked_of(BALL), f"minimise-{ERRORS[0]}.json"),
    output:
        png=captioned(results("figures/figure_5_14.png")),
        svg=results("figures/figure_5_14.svg"),
    log:
        results("logs/figure_5_14.log"),
    benchmark:
        results("benchmarks/figure_5_14.tsv")
    params:
        code=code("figure_5_8"),
        captures=tracked_of(BALL),
        error=ERRORS[0],
    message:
        "Figure 5.14: minimisation for the ball"
    script:
        "../scripts/figure_5_8.py"


rule figure_5_15:
    input:
        mismatches=files_of(tracked_of(BALL), f"mismatch-{ERRORS[0]}.vtu"),
        tracked=files_of(tracked_of(BALL), f"tracked-{TRACKER}.npz"),
    output:
        png=captioned(results("figures/figure_5_15.png")),
        svg=results("figures/figure_5_15.svg"),
    log:
        results("logs/figure_5_15.log"),
    benchmark:
        results("benchmarks/figure_5_15.tsv")
    params:
        code=code("mismatch_views"),
        captures=tracked_of(BALL),
        elevation_deg=ELEVATION_DEG[BALL],
    message:
        "Figure 5.15: mismatch on the ball"
    script:
        "../scripts/mismatch_views.py"


rule figure_5_17:
    input:
        results=files_of(tracked_of(EAR), f"minimise-{ERRORS[0]}.json"),
    output:
        png=captioned(results("figures/figure_5_17.png")),
        svg=results("figures/figure_5_17.svg"),
    log:
        results("logs/figure_5_17.log"),
    benchmark:
        results("benchmarks/figure_5_17.tsv")
    params:
        code=code("figure_5_8"),
        captures=tracked_of(EAR),
        error=ERRORS[0],
    message:
        "Figure 5.17: minimisation for the ear"
    script:
        "../scripts/figure_5_8.py"


rule figure_5_18:
    input:
        mismatches=files_of(tracked_of(EAR), f"mismatch-{ERRORS[0]}.vtu"),
        tracked=files_of(tracked_of(EAR), f"tracked-{TRACKER}.npz"),
    output:
        png=captioned(results("figures/figure_5_18.png")),
        svg=results("figures/figure_5_18.svg"),
    log:
        results("logs/figure_5_18.log"),
    benchmark:
        results("benchmarks/figure_5_18.tsv")
    params:
        code=code("mismatch_views"),
        captures=tracked_of(EAR),
        elevation_deg=ELEVATION_DEG[EAR],
    message:
        "Figure 5.18: mismatch on the ear"
    script:
        "../scripts/mismatch_views.py"


rule comparison:
    input:
        tables=compared_tables(),
        minima=minima_of(traced_captures(), ERRORS[:1]),
        solids=[results(f"{c['object']}/solid.vtu") for c in solids_counted()],
        linear=linear_on_exact_data(),
        materials=[material_of(name) for name in MADE_MATERIALS],
        simulated=simulation_truth(),
        published=printed_tables(),
    output:
        csv=results("tables/comparison.csv"),
        md=results("tables/comparison.md"),
    log:
        results("logs/comparison.log"),
    benchmark:
        results("benchmarks/comparison.tsv")
    params:
        code=code("comparison"),
        captures=traced_captures(),
        error=ERRORS[0],
        solids=solids_counted(),
        materials=MADE_MATERIALS,
        calibrated=calibrated_by_lab(),
    message:
        "Every printed number of the study beside ours"
    script:
        "../scripts/comparison.py"


rule findings:
    input:
        tables=compared_tables(),
        minima=minima_of(traced_captures(), ERRORS[:1]),
        linear=linear_on_exact_data(),
        workspaces=[
            results(f"sensors/{sensor}/workspace.csv")
            for sensor in workspace_sensors()
        ],
        fits=files_of(shrunk_balls(), "hertz.json"),
        single_view=files_of(shrunk_balls(), "tracked-single_view.npz"),
        turned=files_of(shrunk_balls(), "tracked-study.npz"),
        published=printed_tables(),
    output:
        csv=results("tables/findings.csv"),
        md=results("tables/findings.md"),
    log:
        results("logs/findings.log"),
    benchmark:
        results("benchmarks/findings.tsv")
    params:
        code=code("findings"),
        captures=traced_captures(),
        error=ERRORS[0],
        workspaces=workspace_sensors(),
        balls=shrunk_balls(),
    message:
        "The study's findings held against ours"
    script:
        "../scripts/findings.py"
