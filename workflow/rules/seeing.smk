# Section 4.2: how far the probe's pose is to be trusted; figures of Chapter 4 up to tracking.
rule workspace_error:
    input:
        workspace=raw("sensors/{sensor}/workspace"),
        optics=optics_of,
    output:
        table=results("sensors/{sensor}/workspace.csv"),
    log:
        results("logs/workspace_error/{sensor}.log"),
    benchmark:
        results("benchmarks/workspace_error/{sensor}.tsv")
    priority: 10
    params:
        code=code("workspace_error"),
        content=experiment_content("workspace"),
        sensor=sensor_spec,
        probe=experiments_probe,
    message:
        "Error of the resting tip over the workspace, {wildcards.sensor}"
    script:
        "../scripts/workspace_error.py"


rule loading_test:
    input:
        loading=raw("sensors/{sensor}/loading"),
        optics=optics_of,
    output:
        frames=results("sensors/{sensor}/loading.csv"),
        force=results("sensors/{sensor}/loading_force.csv"),
    log:
        results("logs/loading_test/{sensor}.log"),
    benchmark:
        results("benchmarks/loading_test/{sensor}.tsv")
    params:
        code=code("loading_test"),
        content=experiment_content("loading"),
        sensor=sensor_spec,
        probe=experiments_probe,
        pose=config["probe_pose"],
        options=config["force"],
        plane=config["support_plane"],
        onset_force_n=config["hertz"]["onset_force_n"],
        seed=config["seed"],
    message:
        "Force and displacement while loading and holding, {wildcards.sensor}"
    script:
        "../scripts/loading_test.py"


rule figure_4_6:
    input:
        frames=sensor_files("loading", "loading.csv"),
        forces=sensor_files("loading", "loading_force.csv"),
    output:
        png=captioned(results("figures/figure_4_6.png")),
        svg=results("figures/figure_4_6.svg"),
    log:
        results("logs/figure_4_6.log"),
    benchmark:
        results("benchmarks/figure_4_6.tsv")
    params:
        code=code("figure_4_6"),
        names=sensors_of("loading"),
        provenance=experiment_provenance("loading"),
    message:
        "Figure 4.6: force and displacement while loading and holding"
    script:
        "../scripts/figure_4_6.py"


rule cd_case:
    input:
        case=raw("sensors/{sensor}/cd_case"),
        optics=optics_of,
    output:
        path=results("sensors/{sensor}/cd_case_path.csv"),
        place=results("sensors/{sensor}/cd_case.json"),
        cloud=results("sensors/{sensor}/cd_case_cloud.npz"),
    log:
        results("logs/cd_case/{sensor}.log"),
    benchmark:
        results("benchmarks/cd_case/{sensor}.tsv")
    params:
        code=code("cd_case"),
        content=experiment_content("cd_case"),
        sensor=sensor_spec,
        probe=experiments_probe,
        size_m=config["experiments"]["cd_case_size_m"],
        pose=config["probe_pose"],
        plane=config["support_plane"],
        seed=config["seed"],
    message:
        "Tip around the CD case, {wildcards.sensor}"
    script:
        "../scripts/cd_case.py"


rule figure_4_11:
    input:
        model=seen_in("figure_4_11", "{object}/{sensor}/background.npz"),
        mask=seen_in("figure_4_11", "{object}/{sensor}/{capture}/mask.npz"),
        background=seen_raw("figure_4_11", "{object}/{sensor}/background"),
        capture=seen_raw("figure_4_11", "{object}/{sensor}/{capture}"),
    output:
        png=captioned(results("figures/figure_4_11.png")),
        svg=results("figures/figure_4_11.svg"),
    log:
        results("logs/figure_4_11.log"),
    benchmark:
        results("benchmarks/figure_4_11.tsv")
    params:
        code=code("figure_4_11"),
        capture=shown("figure_4_11")[0],
        sensor=HOUSE.sensors[shown("figure_4_11")[0]["sensor"]],
        options=config["background"],
    message:
        "Figure 4.11: colour model of the background subtraction"
    script:
        "../scripts/figure_4_11.py"


rule figure_4_12:
    input:
        pose=seen_in("figure_4_12", "{object}/{sensor}/{capture}/probe_pose.csv"),
    output:
        png=captioned(results("figures/figure_4_12.png")),
        svg=results("figures/figure_4_12.svg"),
    log:
        results("logs/figure_4_12.log"),
    benchmark:
        results("benchmarks/figure_4_12.tsv")
    params:
        code=code("figure_4_12"),
        capture=shown("figure_4_12")[0],
        sensor=HOUSE.sensors[shown("figure_4_12")[0]["sensor"]],
        probe=HOUSE.probe_of(shown("figure_4_12")[0]["object"]),
    message:
        "Figure 4.12: from the tip to the camera"
    script:
        "../scripts/figure_4_12.py"


rule sensor_accuracy:
    input:
        found=[
            results(f"sensors/{sensor}/{READINGS[name]}")
            for sensor, name in read_experiments()
        ],
        truths=[
            truth(f"sensors/{sensor}/{name}.npz")
            for sensor, name in read_experiments()
        ],
    output:
        csv=results("tables/sensor_accuracy.csv"),
        md=results("tables/sensor_accuracy.md"),
    log:
        results("logs/sensor_accuracy.log"),
    benchmark:
        results("benchmarks/sensor_accuracy.tsv")
    params:
        code=code("sensor_accuracy"),
        names=[sensor for sensor, _ in read_experiments()],
        experiments=[name for _, name in read_experiments()],
        sensors=HOUSE.sensors,
    message:
        "Readings about the sensors against the lab's truth"
    script:
        "../scripts/sensor_accuracy.py"
