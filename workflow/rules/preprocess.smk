# Chapter 4: from images and gauge volts to masks, probe poses, forces and clouds.
rule background_model:
    input:
        background=RUN.raw("{object}/{sensor}/background"),
    output:
        model=RUN.results("{object}/{sensor}/background.npz"),
    log:
        RUN.results("logs/background_model/{object}-{sensor}.log"),
    benchmark:
        RUN.results("benchmarks/background_model/{object}-{sensor}.tsv")
    params:
        sensor=RUN.sensor_spec,
        options=RUN.config["background"],
    message:
        "Background model of {wildcards.object}, {wildcards.sensor}"
    script:
        "../scripts/stages/background_model.py"


rule support_plane:
    input:
        background=RUN.scene_of,
        optics=RUN.optics_of,
    output:
        plane=RUN.results("{object}/{sensor}/support_plane.json"),
    log:
        RUN.results("logs/support_plane/{object}-{sensor}.log"),
    benchmark:
        RUN.results("benchmarks/support_plane/{object}-{sensor}.tsv")
    params:
        sensor=RUN.sensor_spec,
        options=RUN.config["support_plane"],
        seed=RUN.config["seed"],
    message:
        "Table plane of {wildcards.object}, {wildcards.sensor}"
    script:
        "../scripts/stages/support_plane.py"


rule mask:
    input:
        capture=RUN.raw("{object}/{sensor}/{capture}"),
        model=RUN.results("{object}/{sensor}/background.npz"),
    output:
        mask=RUN.of_capture("mask.npz"),
    log:
        RUN.results("logs/mask/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/mask/{object}-{sensor}-{capture}.tsv")
    params:
        sensor=RUN.sensor_spec,
        options=RUN.config["background"],
    message:
        "Foreground masks of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/stages/mask.py"


rule probe_pose:
    input:
        capture=RUN.raw("{object}/{sensor}/{capture}"),
        optics=RUN.optics_of,
        calibrations=RUN.calibrations_of,
    output:
        pose=RUN.of_capture("probe_pose.csv"),
    log:
        RUN.results("logs/probe_pose/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/probe_pose/{object}-{sensor}-{capture}.tsv")
    params:
        sensor=RUN.sensor_spec,
        probe=RUN.probe_spec,
        options=RUN.config["probe_pose"],
    message:
        "Probe poses of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/stages/probe_pose.py"


rule force:
    input:
        object=RUN.raw("{object}/object.yaml"),
        capture=RUN.raw("{object}/{sensor}/{capture}"),
        pose=RUN.of_capture("probe_pose.csv"),
        plane=RUN.results("{object}/{sensor}/support_plane.json"),
        calibrations=RUN.calibrations_of,
    output:
        force=RUN.of_capture("force.csv"),
        path=RUN.of_capture("path.csv"),
        clock=RUN.of_capture("clock.json"),
    log:
        RUN.results("logs/force/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/force/{object}-{sensor}-{capture}.tsv")
    params:
        sensor=RUN.sensor_spec,
        probe=RUN.probe_spec,
        options=RUN.config["force"],
    message:
        "Forces of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/stages/force.py"


# All frames of captures that are tracked; the first one is enough for an alignment.
rule clouds:
    input:
        capture=RUN.raw("{object}/{sensor}/{capture}"),
        object=RUN.raw("{object}/object.yaml"),
        template=RUN.template_of,
        optics=RUN.optics_of,
        mask=RUN.mask_of,
        background=RUN.background_of,
        pose=RUN.of_capture("probe_pose.csv"),
        force=RUN.of_capture("force.csv"),
        plane=RUN.results("{object}/{sensor}/support_plane.json"),
    output:
        clouds=RUN.of_capture("clouds.npz"),
    log:
        RUN.results("logs/clouds/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/clouds/{object}-{sensor}-{capture}.tsv")
    params:
        sensor=RUN.sensor_spec,
        probe=RUN.probe_spec,
        options=RUN.config["clouds"],
        frames=None,
    message:
        "Clouds of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/stages/clouds.py"


use rule clouds as rest_cloud with:
    output:
        clouds=RUN.of_capture("rest_cloud.npz"),
    log:
        RUN.results("logs/rest_cloud/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/rest_cloud/{object}-{sensor}-{capture}.tsv")
    params:
        sensor=RUN.sensor_spec,
        probe=RUN.probe_spec,
        options=RUN.config["clouds"],
        frames=[0],
    message:
        "First cloud of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
