# Section 4.1.4: the optics of a sensor's cameras, from pictures of a checkerboard.
rule camera_calibration:
    input:
        pairs=raw("sensors/{sensor}/calibration"),
    output:
        calibration=results("sensors/{sensor}/calibration.json"),
    log:
        results("logs/camera_calibration/{sensor}.log"),
    benchmark:
        results("benchmarks/camera_calibration/{sensor}.tsv")
    params:
        code=code("camera_calibration"),
        content=experiment_content("calibration"),
    message:
        "Calibrating the cameras of the {wildcards.sensor}"
    script:
        "../scripts/camera_calibration.py"


rule table_4_1:
    input:
        calibration=sensor_files("calibration", "calibration.json")[:1],
        published=published("table_4_1"),
    output:
        csv=results("tables/table_4_1.csv"),
        md=results("tables/table_4_1.md"),
    log:
        results("logs/table_4_1.log"),
    benchmark:
        results("benchmarks/table_4_1.tsv")
    params:
        code=code("calibration_report"),
        artefact="table_4_1",
    message:
        "Table 4.1: optics of both cameras"
    script:
        "../scripts/calibration_report.py"


rule figure_4_9:
    input:
        calibration=sensor_files("calibration", "calibration.json")[:1],
        pairs=raw_of_sensors("calibration")[:1],
    output:
        png=captioned(results("figures/figure_4_9.png")),
        svg=results("figures/figure_4_9.svg"),
    log:
        results("logs/figure_4_9.log"),
    benchmark:
        results("benchmarks/figure_4_9.tsv")
    params:
        code=code("calibration_report"),
        artefact="figure_4_9",
    message:
        "Figure 4.9: a pair of calibration pictures"
    script:
        "../scripts/calibration_report.py"


use rule table_4_1 as equation_4_12 with:
    input:
        calibration=sensor_files("calibration", "calibration.json")[:1],
        published=published("equation_4_12"),
    output:
        csv=results("tables/equation_4_12.csv"),
        md=results("tables/equation_4_12.md"),
    log:
        results("logs/equation_4_12.log"),
    benchmark:
        results("benchmarks/equation_4_12.tsv")
    params:
        artefact="equation_4_12",
    message:
        "Equation 4.12: from the infrared to the colour camera"


use rule figure_4_9 as figure_4_10 with:
    output:
        png=captioned(results("figures/figure_4_10.png")),
        svg=results("figures/figure_4_10.svg"),
    log:
        results("logs/figure_4_10.log"),
    benchmark:
        results("benchmarks/figure_4_10.tsv")
    params:
        artefact="figure_4_10",
    message:
        "Figure 4.10: poses of the board"
