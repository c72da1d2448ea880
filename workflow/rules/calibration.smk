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


rule calibration_report:
    input:
        calibration=sensor_files("calibration", "calibration.json")[:1],
        pairs=raw_of_sensors("calibration")[:1],
        table_4_1=published("table_4_1"),
        equation_4_12=published("equation_4_12"),
    output:
        table_csv=results("tables/table_4_1.csv"),
        table_md=results("tables/table_4_1.md"),
        equation_csv=results("tables/equation_4_12.csv"),
        equation_md=results("tables/equation_4_12.md"),
        figure_4_9_png=results("figures/figure_4_9.png"),
        figure_4_9_svg=results("figures/figure_4_9.svg"),
        figure_4_10_png=results("figures/figure_4_10.png"),
        figure_4_10_svg=results("figures/figure_4_10.svg"),
    log:
        results("logs/calibration_report.log"),
    benchmark:
        results("benchmarks/calibration_report.tsv")
    params:
        code=code("calibration_report"),
    message:
        "Table 4.1, Equation 4.12, Figures 4.9 and 4.10: calibration"
    script:
        "../scripts/calibration_report.py"
