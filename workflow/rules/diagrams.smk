# Diagrams of the sensors and views of the rig, drawn from what is configured.
rule figure_1_1:
    output:
        png=captioned(results("figures/figure_1_1.png")),
        svg=results("figures/figure_1_1.svg"),
    log:
        results("logs/figure_1_1.log"),
    benchmark:
        results("benchmarks/figure_1_1.tsv")
    params:
        code=code("figure_1_1"),
        rules=way_to_parameters,
    message:
        "Figure 1.1: from capture to parameters"
    script:
        "../scripts/figure_1_1.py"


rule figure_4_1:
    output:
        png=captioned(results("figures/figure_4_1.png")),
        svg=results("figures/figure_4_1.svg"),
    log:
        results("logs/figure_4_1.log"),
    benchmark:
        results("benchmarks/figure_4_1.tsv")
    params:
        code=code("figure_4_1"),
        devices=devices(),
    message:
        "Figure 4.1: depth devices"
    script:
        "../scripts/figure_4_1.py"


rule figure_4_2:
    output:
        png=captioned(results("figures/figure_4_2.png")),
        svg=results("figures/figure_4_2.svg"),
    log:
        results("logs/figure_4_2.log"),
    benchmark:
        results("benchmarks/figure_4_2.tsv")
    params:
        code=code("figure_4_2"),
        sensor=HOUSE.sensors.get(dot_sensor()),
        depth_m=drawn_depth(dot_sensor()),
    message:
        "Figure 4.2: triangulation of the dot pattern"
    script:
        "../scripts/figure_4_2.py"


rule figure_4_3:
    output:
        png=captioned(results("figures/figure_4_3.png")),
        svg=results("figures/figure_4_3.svg"),
    log:
        results("logs/figure_4_3.log"),
    benchmark:
        results("benchmarks/figure_4_3.tsv")
    params:
        code=code("figure_4_3"),
        sensor=HOUSE.sensors.get(of_kind("stereo")),
        depth_m=drawn_depth(of_kind("stereo")),
    message:
        "Figure 4.3: triangulation of the stereo pair"
    script:
        "../scripts/figure_4_3.py"


rule figure_4_4:
    input:
        clouds=files_of(clouds_shown(), "clouds.npz"),
        alignments=files_of(clouds_shown(), "alignment.json"),
    output:
        png=captioned(results("figures/figure_4_4.png")),
        svg=results("figures/figure_4_4.svg"),
    log:
        results("logs/figure_4_4.log"),
    benchmark:
        results("benchmarks/figure_4_4.tsv")
    params:
        code=code("figure_4_4"),
        captures=clouds_shown(),
        neighbours=config["clouds"]["normal_neighbours"],
    message:
        "Figure 4.4: plane through a vertex and its neighbours"
    script:
        "../scripts/figure_4_4.py"


rule figure_4_5:
    output:
        png=captioned(results("figures/figure_4_5.png")),
        svg=results("figures/figure_4_5.svg"),
    log:
        results("logs/figure_4_5.log"),
    benchmark:
        results("benchmarks/figure_4_5.tsv")
    params:
        code=code("figure_4_5"),
        probe=drawn_probe(),
    message:
        "Figure 4.5: force sensor and indenter"
    script:
        "../scripts/figure_4_5.py"


rule figure_4_7:
    output:
        png=captioned(results("figures/figure_4_7.png")),
        svg=results("figures/figure_4_7.svg"),
    log:
        results("logs/figure_4_7.log"),
    benchmark:
        results("benchmarks/figure_4_7.tsv")
    params:
        code=code("figure_4_7"),
        setups=setups(),
    message:
        "Figure 4.7: capture setups"
    script:
        "../scripts/figure_4_7.py"


rule figure_4_8:
    output:
        png=captioned(results("figures/figure_4_8.png")),
        svg=results("figures/figure_4_8.svg"),
    log:
        results("logs/figure_4_8.log"),
    benchmark:
        results("benchmarks/figure_4_8.tsv")
    params:
        code=code("figure_4_8"),
        sensor=HOUSE.sensors.get(pinhole_sensor()),
        depth_m=drawn_depth(pinhole_sensor()),
    message:
        "Figure 4.8: pinhole camera model"
    script:
        "../scripts/figure_4_8.py"
