# Chapter 4: from images and gauge volts to masks, probe poses, forces and clouds.
rule background_model:
    input:
        background=RAW + "/{object}/{sensor}/background",
    output:
        model=RESULTS + "/{object}/{sensor}/background.npz",
    log:
        RESULTS + "/logs/background_model/{object}-{sensor}.log",
    benchmark:
        RESULTS + "/benchmarks/background_model/{object}-{sensor}.tsv"
    params:
        code=code("background_model"),
        content=content(RAW + "/{object}/{sensor}/background"),
        sensor=sensor_spec,
        options=config["background"],
    message:
        "Background model of {wildcards.object}, {wildcards.sensor}"
    script:
        "../scripts/background_model.py"


rule support_plane:
    input:
        background=RAW + "/{object}/{sensor}/background",
    output:
        plane=RESULTS + "/{object}/{sensor}/support_plane.json",
    log:
        RESULTS + "/logs/support_plane/{object}-{sensor}.log",
    benchmark:
        RESULTS + "/benchmarks/support_plane/{object}-{sensor}.tsv"
    params:
        code=code("support_plane"),
        content=content(RAW + "/{object}/{sensor}/background"),
        sensor=sensor_spec,
        options=config["support_plane"],
        seed=config["seed"],
    message:
        "Table plane of {wildcards.object}, {wildcards.sensor}"
    script:
        "../scripts/support_plane.py"


rule mask:
    input:
        capture=RAW + "/{object}/{sensor}/{capture}",
        model=RESULTS + "/{object}/{sensor}/background.npz",
    output:
        mask=CAPTURE + "/mask.npz",
    log:
        RESULTS + "/logs/mask/{object}-{sensor}-{capture}.log",
    benchmark:
        RESULTS + "/benchmarks/mask/{object}-{sensor}-{capture}.tsv"
    params:
        code=code("mask"),
        content=content(RAW + "/{object}/{sensor}/{capture}"),
        sensor=sensor_spec,
        options=config["background"],
    message:
        "Foreground masks of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/mask.py"


rule probe_pose:
    input:
        capture=RAW + "/{object}/{sensor}/{capture}",
    output:
        pose=CAPTURE + "/probe_pose.csv",
    log:
        RESULTS + "/logs/probe_pose/{object}-{sensor}-{capture}.log",
    benchmark:
        RESULTS + "/benchmarks/probe_pose/{object}-{sensor}-{capture}.tsv"
    params:
        code=code("probe_pose"),
        content=content(RAW + "/{object}/{sensor}/{capture}"),
        sensor=sensor_spec,
        probe=probe_spec,
        options=config["probe_pose"],
    message:
        "Probe poses of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/probe_pose.py"


rule force:
    input:
        capture=RAW + "/{object}/{sensor}/{capture}",
        pose=CAPTURE + "/probe_pose.csv",
    output:
        force=CAPTURE + "/force.csv",
    log:
        RESULTS + "/logs/force/{object}-{sensor}-{capture}.log",
    benchmark:
        RESULTS + "/benchmarks/force/{object}-{sensor}-{capture}.tsv"
    params:
        code=code("force"),
        content=content(RAW + "/{object}/{sensor}/{capture}"),
        probe=probe_spec,
        options=config["force"],
    message:
        "Forces of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/force.py"


rule clouds:
    input:
        capture=RAW + "/{object}/{sensor}/{capture}",
        mask=CAPTURE + "/mask.npz",
        pose=CAPTURE + "/probe_pose.csv",
        plane=RESULTS + "/{object}/{sensor}/support_plane.json",
    output:
        clouds=CAPTURE + "/clouds.npz",
    log:
        RESULTS + "/logs/clouds/{object}-{sensor}-{capture}.log",
    benchmark:
        RESULTS + "/benchmarks/clouds/{object}-{sensor}-{capture}.tsv"
    params:
        code=code("clouds"),
        content=content(RAW + "/{object}/{sensor}/{capture}"),
        sensor=sensor_spec,
        probe=probe_spec,
        options=config["clouds"],
    message:
        "Clouds of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/clouds.py"
