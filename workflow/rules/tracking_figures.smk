# Figures 5.5 to 5.16: tracked surfaces, and what the added points are for.
rule figure_5_5:
    input:
        **recorded_files(block_shown("figure_5_5")),
        tracked=files_of(block_shown("figure_5_5"), "tracked-study.npz"),
        recorded=recordings_of(block_shown("figure_5_5")),
        optics=calibrations_of(block_shown("figure_5_5")),
    output:
        png=captioned(results("figures/figure_5_5.png")),
        svg=results("figures/figure_5_5.svg"),
    log:
        results("logs/figure_5_5.log"),
    benchmark:
        results("benchmarks/figure_5_5.tsv")
    params:
        code=code("figure_5_5"),
        captures=block_shown("figure_5_5"),
        probes=probes_of(block_shown("figure_5_5")),
        sensors=sensors_shown(block_shown("figure_5_5")),
        options=options_shown(block_shown("figure_5_5"), "study"),
    message:
        "Figure 5.5: tracking the block"
    script:
        "../scripts/figure_5_5.py"


rule figure_5_6:
    input:
        **recorded_files(at_the_end()),
        planes=[
            results("{object}/{sensor}/support_plane.json".format(**c))
            for c in at_the_end()
        ],
    output:
        png=captioned(results("figures/figure_5_6.png")),
        svg=results("figures/figure_5_6.svg"),
    log:
        results("logs/figure_5_6.log"),
    benchmark:
        results("benchmarks/figure_5_6.tsv")
    params:
        code=code("figure_5_6"),
        captures=at_the_end(),
        probes=probes_of(at_the_end()),
        options=config["tracking"]["alignment"],
    message:
        "Figure 5.6: rigid alignment that slides"
    script:
        "../scripts/figure_5_6.py"


rule figure_5_7:
    input:
        **recorded_files(block_shown("figure_5_7")),
        tracked=files_of(block_shown("figure_5_7"), "tracked-study.npz"),
        unrefined=files_of(block_shown("figure_5_7"), "tracked-unrefined.npz"),
    output:
        png=captioned(results("figures/figure_5_7.png")),
        svg=results("figures/figure_5_7.svg"),
    log:
        results("logs/figure_5_7.log"),
    benchmark:
        results("benchmarks/figure_5_7.tsv")
    params:
        code=code("figure_5_7"),
        captures=block_shown("figure_5_7"),
        probes=probes_of(block_shown("figure_5_7")),
    message:
        "Figure 5.7: tracking without refinement"
    script:
        "../scripts/figure_5_7.py"


rule figure_5_11:
    input:
        **recorded_files(tracked_of(BALL)),
        tracked=files_of(tracked_of(BALL), "tracked-study.npz"),
    output:
        png=captioned(results("figures/figure_5_11.png")),
        svg=results("figures/figure_5_11.svg"),
    log:
        results("logs/figure_5_11.log"),
    benchmark:
        results("benchmarks/figure_5_11.tsv")
    params:
        code=code("figure_5_11"),
        captures=tracked_of(BALL),
        probes=probes_of(tracked_of(BALL)),
        options=options_shown(tracked_of(BALL), "study"),
    message:
        "Figure 5.11: turned clouds of the ball"
    script:
        "../scripts/figure_5_11.py"


rule figure_5_12:
    input:
        **recorded_files(tracked_of(BALL)),
        tracked=files_of(tracked_of(BALL), "tracked-study.npz"),
    output:
        png=captioned(results("figures/figure_5_12.png")),
        svg=results("figures/figure_5_12.svg"),
    log:
        results("logs/figure_5_12.log"),
    benchmark:
        results("benchmarks/figure_5_12.tsv")
    params:
        code=code("figure_5_12"),
        captures=tracked_of(BALL),
        probes=probes_of(tracked_of(BALL)),
        solid=config["solid"],
        force_rule=config["minimise"]["force_rule"],
    message:
        "Figure 5.12: direction of the force on the ball"
    script:
        "../scripts/figure_5_12.py"


rule figure_5_13:
    input:
        alignment=files_of(tracked_of(BALL), "alignment.json"),
        fits=files_of(tracked_of(BALL), "hertz.json"),
        tracked=files_of(tracked_of(BALL), "tracked-study.npz"),
        single_view=files_of(tracked_of(BALL), "tracked-single_view.npz"),
    output:
        png=captioned(results("figures/figure_5_13.png")),
        svg=results("figures/figure_5_13.svg"),
    log:
        results("logs/figure_5_13.log"),
    benchmark:
        results("benchmarks/figure_5_13.tsv")
    params:
        code=code("figure_5_13"),
        captures=tracked_of(BALL),
    message:
        "Figure 5.13: tracking the ball"
    script:
        "../scripts/figure_5_13.py"


rule figure_5_16:
    input:
        **recorded_files(tracked_of(EAR)),
        tracked=files_of(tracked_of(EAR), "tracked-study.npz"),
        recorded=recordings_of(tracked_of(EAR)),
        optics=calibrations_of(tracked_of(EAR)),
    output:
        png=captioned(results("figures/figure_5_16.png")),
        svg=results("figures/figure_5_16.svg"),
    log:
        results("logs/figure_5_16.log"),
    benchmark:
        results("benchmarks/figure_5_16.tsv")
    params:
        code=code("figure_5_16"),
        captures=tracked_of(EAR),
        probes=probes_of(tracked_of(EAR)),
        sensors=sensors_shown(tracked_of(EAR)),
    message:
        "Figure 5.16: tracking the ear"
    script:
        "../scripts/figure_5_16.py"


rule tracking_accuracy_figure:
    input:
        table=results("tables/tracking_accuracy.csv"),
    output:
        png=captioned(results("figures/tracking_accuracy.png")),
        svg=results("figures/tracking_accuracy.svg"),
    log:
        results("logs/tracking_accuracy_figure.log"),
    benchmark:
        results("benchmarks/tracking_accuracy_figure.tsv")
    params:
        code=code("tracking_accuracy_figure"),
    message:
        "Accuracy of the trackers, drawn"
    script:
        "../scripts/tracking_accuracy_figure.py"
