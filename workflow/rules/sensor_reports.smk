# Tables and figures of the workspace and the CD case (Sections 4.2.3 and 4.2.4), a rule each.
rule table_4_2:
    input:
        tables=sensor_files("workspace", "workspace.csv"),
        published=published("table_4_2"),
    output:
        csv=results("tables/table_4_2.csv"),
        md=results("tables/table_4_2.md"),
    log:
        results("logs/table_4_2.log"),
    benchmark:
        results("benchmarks/table_4_2.tsv")
    params:
        code=code("workspace_report"),
        artefact="table_4_2",
        names=sensors_of("workspace"),
        sensors=HOUSE.sensors,
        provenance=experiment_provenance("workspace"),
    message:
        "Table 4.2: scatter of the resting tip"
    script:
        "../scripts/workspace_report.py"


rule figure_4_14:
    input:
        tables=sensor_files("workspace", "workspace.csv"),
    output:
        png=captioned(results("figures/figure_4_14.png")),
        svg=results("figures/figure_4_14.svg"),
    log:
        results("logs/figure_4_14.log"),
    benchmark:
        results("benchmarks/figure_4_14.tsv")
    params:
        code=code("workspace_report"),
        artefact="figure_4_14",
        names=sensors_of("workspace"),
        provenance=experiment_provenance("workspace"),
    message:
        "Figure 4.14: points of the workspace"
    script:
        "../scripts/workspace_report.py"


use rule figure_4_14 as figure_4_15 with:
    output:
        png=captioned(results("figures/figure_4_15.png")),
        svg=results("figures/figure_4_15.svg"),
    log:
        results("logs/figure_4_15.log"),
    benchmark:
        results("benchmarks/figure_4_15.tsv")
    params:
        artefact="figure_4_15",
    message:
        "Figure 4.15: the tip against the threshold"


use rule figure_4_14 as figure_4_16 with:
    output:
        png=captioned(results("figures/figure_4_16.png")),
        svg=results("figures/figure_4_16.svg"),
    log:
        results("logs/figure_4_16.log"),
    benchmark:
        results("benchmarks/figure_4_16.tsv")
    params:
        artefact="figure_4_16",
    message:
        "Figure 4.16: the board's angle against the threshold"


use rule figure_4_14 as figure_4_17 with:
    output:
        png=captioned(results("figures/figure_4_17.png")),
        svg=results("figures/figure_4_17.svg"),
    log:
        results("logs/figure_4_17.log"),
    benchmark:
        results("benchmarks/figure_4_17.tsv")
    params:
        artefact="figure_4_17",
    message:
        "Figure 4.17: inliers against the threshold"


use rule figure_4_14 as figure_4_18 with:
    output:
        png=captioned(results("figures/figure_4_18.png")),
        svg=results("figures/figure_4_18.svg"),
    log:
        results("logs/figure_4_18.log"),
    benchmark:
        results("benchmarks/figure_4_18.tsv")
    params:
        artefact="figure_4_18",
    message:
        "Figure 4.18: reprojection error against the threshold"


use rule figure_4_14 as figure_4_19 with:
    output:
        png=captioned(results("figures/figure_4_19.png")),
        svg=results("figures/figure_4_19.svg"),
    log:
        results("logs/figure_4_19.log"),
    benchmark:
        results("benchmarks/figure_4_19.tsv")
    params:
        artefact="figure_4_19",
    message:
        "Figure 4.19: the tip against its distance"


rule cd_case_table:
    input:
        paths=sensor_files("cd_case", "cd_case_path.csv"),
        places=sensor_files("cd_case", "cd_case.json"),
    output:
        csv=results("tables/cd_case.csv"),
        md=results("tables/cd_case.md"),
    log:
        results("logs/cd_case_table.log"),
    benchmark:
        results("benchmarks/cd_case_table.tsv")
    params:
        code=code("cd_case_report"),
        artefact="cd_case_table",
        names=sensors_of("cd_case"),
        provenance=experiment_provenance("cd_case"),
    message:
        "Table of the traced CD case"
    script:
        "../scripts/cd_case_report.py"


rule figure_4_13:
    input:
        paths=sensor_files("cd_case", "cd_case_path.csv"),
        places=sensor_files("cd_case", "cd_case.json"),
        clouds=sensor_files("cd_case", "cd_case_cloud.npz"),
        cases=raw_of_sensors("cd_case"),
    output:
        png=captioned(results("figures/figure_4_13.png")),
        svg=results("figures/figure_4_13.svg"),
    log:
        results("logs/figure_4_13.log"),
    benchmark:
        results("benchmarks/figure_4_13.tsv")
    params:
        code=code("cd_case_report"),
        artefact="figure_4_13",
        names=sensors_of("cd_case"),
        sensors=HOUSE.sensors,
        provenance=experiment_provenance("cd_case"),
    message:
        "Figure 4.13: the tip before and after filtering"
    script:
        "../scripts/cd_case_report.py"


use rule figure_4_13 as figure_4_20 with:
    output:
        png=captioned(results("figures/figure_4_20.png")),
        svg=results("figures/figure_4_20.svg"),
    log:
        results("logs/figure_4_20.log"),
    benchmark:
        results("benchmarks/figure_4_20.tsv")
    params:
        artefact="figure_4_20",
    message:
        "Figure 4.20: the CD case while it is traced"


use rule figure_4_13 as figure_4_21 with:
    output:
        png=captioned(results("figures/figure_4_21.png")),
        svg=results("figures/figure_4_21.svg"),
    log:
        results("logs/figure_4_21.log"),
    benchmark:
        results("benchmarks/figure_4_21.tsv")
    params:
        artefact="figure_4_21",
    message:
        "Figure 4.21: the traced path and the case's cloud"
