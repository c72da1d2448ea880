# Section 4.1.4: the optics of a sensor's cameras, from pictures of a checkerboard.
rule camera_calibration:
    input:
        pairs=RUN.raw("sensors/{sensor}/calibration"),
    output:
        calibration=RUN.results("sensors/{sensor}/calibration.json"),
    log:
        RUN.results("logs/camera_calibration/{sensor}.log"),
    benchmark:
        RUN.results("benchmarks/camera_calibration/{sensor}.tsv")
    conda:
        "../envs/palpate.yaml"
    message:
        "Calibrating the cameras of the {wildcards.sensor}"
    script:
        "../scripts/stages/camera_calibration.py"
