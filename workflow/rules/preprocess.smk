# Chapter 4: from images and gauge volts to masks, probe poses, forces and clouds.
rule background_model:
    input:
        background=raw("{object}/{sensor}/background"),
    output:
        model=results("{object}/{sensor}/background.npz"),
    log:
        results("logs/background_model/{object}-{sensor}.log"),
    benchmark:
        results("benchmarks/background_model/{object}-{sensor}.tsv")
    params:
        code=code("background_model"),
        content=content(raw("{object}/{sensor}/background")),
        sensor=sensor_spec,
        options=config["background"],
    message:
        "Background model of {wildcards.object}, {wildcards.sensor}"
    script:
        "../scripts/background_model.py"


rule support_plane:
    input:
        background=raw("{object}/{sensor}/background"),
        optics=optics_of,
    output:
        plane=results("{object}/{sensor}/support_plane.json"),
    log:
        results("logs/support_plane/{object}-{sensor}.log"),
    benchmark:
        results("benchmarks/support_plane/{object}-{sensor}.tsv")
    params:
        code=code("support_plane"),
        content=content(raw("{object}/{sensor}/background")),
        sensor=sensor_spec,
        options=config["support_plane"],
        seed=config["seed"],
    message:
        "Table plane of {wildcards.object}, {wildcards.sensor}"
    script:
        "../scripts/support_plane.py"


rule mask:
    input:
        capture=raw("{object}/{sensor}/{capture}"),
        model=results("{object}/{sensor}/background.npz"),
    output:
        mask=of_capture("mask.npz"),
    log:
        results("logs/mask/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/mask/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("mask"),
        content=content(raw("{object}/{sensor}/{capture}")),
        sensor=sensor_spec,
        options=config["background"],
    message:
        "Foreground masks of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/mask.py"


rule probe_pose:
    input:
        capture=raw("{object}/{sensor}/{capture}"),
        optics=optics_of,
    output:
        pose=of_capture("probe_pose.csv"),
    log:
        results("logs/probe_pose/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/probe_pose/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("probe_pose"),
        content=content(raw("{object}/{sensor}/{capture}")),
        sensor=sensor_spec,
        probe=probe_spec,
        options=config["probe_pose"],
    message:
        "Probe poses of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/probe_pose.py"


rule force:
    input:
        capture=raw("{object}/{sensor}/{capture}"),
        pose=of_capture("probe_pose.csv"),
        plane=results("{object}/{sensor}/support_plane.json"),
    output:
        force=of_capture("force.csv"),
        clock=of_capture("clock.json"),
    log:
        results("logs/force/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/force/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("force"),
        content=content(raw("{object}/{sensor}/{capture}")),
        probe=probe_spec,
        options=config["force"],
    message:
        "Forces of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/force.py"


# All frames of captures that are tracked; the first one is enough for an alignment.
rule clouds:
    input:
        capture=raw("{object}/{sensor}/{capture}"),
        optics=optics_of,
        mask=of_capture("mask.npz"),
        pose=of_capture("probe_pose.csv"),
        plane=results("{object}/{sensor}/support_plane.json"),
    output:
        clouds=of_capture("clouds.npz"),
    log:
        results("logs/clouds/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/clouds/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("clouds"),
        content=content(raw("{object}/{sensor}/{capture}")),
        sensor=sensor_spec,
        probe=probe_spec,
        options=config["clouds"],
        frames=None,
    message:
        "Clouds of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/clouds.py"


rule rest_cloud:
    input:
        capture=raw("{object}/{sensor}/{capture}"),
        optics=optics_of,
        mask=of_capture("mask.npz"),
        pose=of_capture("probe_pose.csv"),
        plane=results("{object}/{sensor}/support_plane.json"),
    output:
        clouds=of_capture("rest_cloud.npz"),
    log:
        results("logs/rest_cloud/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/rest_cloud/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("clouds"),
        content=content(raw("{object}/{sensor}/{capture}")),
        sensor=sensor_spec,
        probe=probe_spec,
        options=config["clouds"],
        frames=[0],
    message:
        "First cloud of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/clouds.py"
