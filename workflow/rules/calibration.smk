from palpate.config.probe import PARTS

# Options of a part's calibration beside those of poses.
ASKED = {"tip": (), "load": ("support_plane", "seed"), "stiffness": ("force",)}


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
    message:
        "Calibrating the cameras of the {wildcards.sensor}"
    script:
        "../scripts/stages/camera_calibration.py"


# The camera in a robot's or a tracker's base frame, from a target on what is tracked.
rule hand_eye:
    input:
        recording=RUN.raw("sensors/{sensor}/hand_eye"),
        optics=RUN.optics_of,
    output:
        hand_eye=RUN.results("sensors/{sensor}/hand_eye.json"),
    log:
        RUN.results("logs/hand_eye/{sensor}.log"),
    benchmark:
        RUN.results("benchmarks/hand_eye/{sensor}.tsv")
    params:
        sensor=RUN.sensor_spec,
    message:
        "Finding the {wildcards.sensor} in the base frame"
    script:
        "../scripts/stages/hand_eye.py"


# The probe's tip, payload and compliance, each from a recording of the probe by itself.
for part in PARTS:

    rule:
        name:
            part.name
        input:
            film=RUN.raw(f"sensors/{{sensor}}/{part.recording}"),
            optics=RUN.optics_of,
        output:
            fields=RUN.results(f"sensors/{{sensor}}/{part.name}.json"),
        log:
            RUN.results(f"logs/{part.name}/{{sensor}}.log"),
        benchmark:
            RUN.results(f"benchmarks/{part.name}/{{sensor}}.tsv")
        params:
            part=part.name,
            sensor=RUN.sensor_spec,
            probe=RUN.experiment_probe,
            options=RUN.config["probe_pose"],
            more={name: RUN.config[name] for name in ASKED[part.name]},
        message:
            f"Calibrating the probe ({part.name}) by the {{wildcards.sensor}}"
        script:
            "../scripts/stages/probe_calibration.py"
