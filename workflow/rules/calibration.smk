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


# Where the ball is in the board's frame, from a handle that turned about its resting tip.
rule tip:
    input:
        film=RUN.film_of("tip"),
        optics=RUN.optics_of,
    output:
        tip=RUN.results("sensors/{sensor}/tip.json"),
    log:
        RUN.results("logs/tip/{sensor}.log"),
    benchmark:
        RUN.results("benchmarks/tip/{sensor}.tsv")
    conda:
        "../envs/palpate.yaml"
    params:
        sensor=RUN.sensor_spec,
        probe=RUN.experiment_probe,
        options=RUN.config["probe_pose"],
    message:
        "Where the tip is, by the {wildcards.sensor}"
    script:
        "../scripts/stages/tip.py"


# What hangs on the force sensor and how it sits, from a probe held still in the air in many poses.
rule load:
    input:
        film=RUN.film_of("load"),
        optics=RUN.optics_of,
    output:
        load=RUN.results("sensors/{sensor}/load.json"),
    log:
        RUN.results("logs/load/{sensor}.log"),
    benchmark:
        RUN.results("benchmarks/load/{sensor}.tsv")
    conda:
        "../envs/palpate.yaml"
    params:
        sensor=RUN.sensor_spec,
        probe=RUN.experiment_probe,
        options=RUN.config["probe_pose"],
        plane=RUN.config["support_plane"],
        seed=RUN.config["seed"],
    message:
        "What hangs on the force sensor, by the {wildcards.sensor}"
    script:
        "../scripts/stages/load.py"


# What the probe gives way by, from a press of its ball on something rigid.
rule stiffness:
    input:
        film=RUN.film_of("stiffness"),
        optics=RUN.optics_of,
    output:
        stiffness=RUN.results("sensors/{sensor}/stiffness.json"),
    log:
        RUN.results("logs/stiffness/{sensor}.log"),
    benchmark:
        RUN.results("benchmarks/stiffness/{sensor}.tsv")
    conda:
        "../envs/palpate.yaml"
    params:
        sensor=RUN.sensor_spec,
        probe=RUN.experiment_probe,
        options=RUN.config["probe_pose"],
        force=RUN.config["force"],
    message:
        "What the probe gives way by, by the {wildcards.sensor}"
    script:
        "../scripts/stages/stiffness.py"
