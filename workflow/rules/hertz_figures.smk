# Figures of Section 5.1, Appendix A and the diagrams of Chapter 3.
rule figure_5_1:
    input:
        object=seen_raw("figure_5_1", "{object}/object.yaml"),
        template=grid_template(),
        alignment=seen_in("figure_5_1", "{object}/{sensor}/{capture}/alignment.json"),
        recorded=seen_raw("figure_5_1", "{object}/{sensor}/{capture}"),
        optics=grid_optics(),
    output:
        png=captioned(results("figures/figure_5_1.png")),
        svg=results("figures/figure_5_1.svg"),
    log:
        results("logs/figure_5_1.log"),
    benchmark:
        results("benchmarks/figure_5_1.tsv")
    params:
        code=code("figure_5_1"),
        capture=shown("figure_5_1")[0],
        sensor=HOUSE.sensors[shown("figure_5_1")[0]["sensor"]],
    message:
        "Figure 5.1: grid of sample points"
    script:
        "../scripts/figure_5_1.py"


rule figure_5_2:
    input:
        fits=files_of(shown("figure_5_2"), "hertz.json"),
    output:
        png=captioned(results("figures/figure_5_2.png")),
        svg=results("figures/figure_5_2.svg"),
    log:
        results("logs/figure_5_2.log"),
    benchmark:
        results("benchmarks/figure_5_2.tsv")
    params:
        code=code("figure_5_2"),
        captures=shown("figure_5_2"),
    message:
        "Figure 5.2: Hertz fit"
    script:
        "../scripts/figure_5_2.py"


rule figure_5_3:
    input:
        fits=files_of(repeated(), "hertz.json"),
        published=published("table_5_1"),
    output:
        png=captioned(results("figures/figure_5_3.png")),
        svg=results("figures/figure_5_3.svg"),
    log:
        results("logs/figure_5_3.log"),
    benchmark:
        results("benchmarks/figure_5_3.tsv")
    params:
        code=code("figure_5_3"),
        captures=repeated(),
    message:
        "Figure 5.3: repeated recordings of one point"
    script:
        "../scripts/figure_5_3.py"


rule figure_5_4:
    input:
        fits=files_of(over_the_block(), "hertz.json"),
        published=published("table_5_2"),
    output:
        png=captioned(results("figures/figure_5_4.png")),
        svg=results("figures/figure_5_4.svg"),
    log:
        results("logs/figure_5_4.log"),
    benchmark:
        results("benchmarks/figure_5_4.tsv")
    params:
        code=code("figure_5_4"),
        captures=over_the_block(),
        block=config["study"]["block"],
    message:
        "Figure 5.4: reduced modulus over the block"
    script:
        "../scripts/figure_5_4.py"


rule figure_a_1:
    input:
        fits=files_of(over_the_block("bumblebee"), "hertz.json"),
    output:
        png=captioned(results("figures/figure_a_1.png")),
        svg=results("figures/figure_a_1.svg"),
    log:
        results("logs/figure_a_1.log"),
    benchmark:
        results("benchmarks/figure_a_1.tsv")
    params:
        code=code("figure_a_1"),
        captures=over_the_block("bumblebee"),
    message:
        "Figure A.1: Hertz fits at all points, bumblebee"
    script:
        "../scripts/figure_a_1.py"


rule figure_a_2:
    input:
        fits=files_of(over_the_block("kinect"), "hertz.json"),
    output:
        png=captioned(results("figures/figure_a_2.png")),
        svg=results("figures/figure_a_2.svg"),
    log:
        results("logs/figure_a_2.log"),
    benchmark:
        results("benchmarks/figure_a_2.tsv")
    params:
        code=code("figure_a_2"),
        captures=over_the_block("kinect"),
    message:
        "Figure A.2: Hertz fits at all points, kinect"
    script:
        "../scripts/figure_a_2.py"


rule figure_3_1:
    output:
        png=captioned(results("figures/figure_3_1.png")),
        svg=results("figures/figure_3_1.svg"),
    log:
        results("logs/figure_3_1.log"),
    benchmark:
        results("benchmarks/figure_3_1.tsv")
    params:
        code=code("figure_3_1"),
    message:
        "Figure 3.1: mechanical quantities and their laws"
    script:
        "../scripts/figure_3_1.py"


rule figure_3_2:
    output:
        png=captioned(results("figures/figure_3_2.png")),
        svg=results("figures/figure_3_2.svg"),
    log:
        results("logs/figure_3_2.log"),
    benchmark:
        results("benchmarks/figure_3_2.tsv")
    params:
        code=code("figure_3_2"),
    message:
        "Figure 3.2: stress on an infinitesimal cube"
    script:
        "../scripts/figure_3_2.py"


rule figure_3_8:
    input:
        steps=f"{RAW}/simulations/foam_block.npz",
    output:
        png=captioned(results("figures/figure_3_8.png")),
        svg=results("figures/figure_3_8.svg"),
    log:
        results("logs/figure_3_8.log"),
    benchmark:
        results("benchmarks/figure_3_8.tsv")
    params:
        code=code("figure_3_8"),
    message:
        "Figure 3.8: moves of the Nelder-Mead simplex"
    script:
        "../scripts/figure_3_8.py"
