# Sections 3.3.2 to 3.3.4: the simulated block, the linear method and the error minimisation.
rule simulation_tracked:
    input:
        steps=SIMULATED_STEPS,
    output:
        tracked=results("simulation/tracked.npz"),
    log:
        results("logs/simulation_tracked.log"),
    benchmark:
        results("benchmarks/simulation_tracked.tsv")
    params:
        code=code("simulation_tracked"),
        options=simulation_options("cuts", "corners", "tracking"),
    message:
        "Tracking the simulated block"
    script:
        "../scripts/simulation_tracked.py"


rule linear_method:
    input:
        steps=SIMULATED_STEPS,
        tracked=simulation_tracked,
    output:
        result=results("simulation/linear-{data}.json"),
    log:
        results("logs/linear_method/{data}.log"),
    benchmark:
        results("benchmarks/linear_method/{data}.tsv")
    wildcard_constraints:
        data=one_of(SIMULATED_DATA),
    params:
        code=code("linear_method"),
        options=simulation_options("support", "linear"),
    message:
        "Linear method on the simulated block ({wildcards.data} data)"
    script:
        "../scripts/linear_method.py"


rule simulation_minimise:
    input:
        steps=SIMULATED_STEPS,
        tracked=simulation_tracked,
    output:
        result=results("simulation/minimise-{data}-{error}.json"),
        mismatch=results("simulation/mismatch-{data}-{error}.vtu"),
    log:
        results("logs/simulation_minimise/{data}-{error}.log"),
    benchmark:
        results("benchmarks/simulation_minimise/{data}-{error}.tsv")
    wildcard_constraints:
        data=one_of(SIMULATED_DATA),
    params:
        code=code("simulation_minimise"),
        support=config["simulation"]["support"],
        options=SEARCH,
    message:
        "Error minimisation ({wildcards.error}) on the simulated block ({wildcards.data} data)"
    script:
        "../scripts/simulation_minimise.py"


rule simulation_table:
    input:
        linear=expand(results("simulation/linear-{data}.json"), data=SIMULATED_DATA),
        minima=simulation_minima(),
        published=published("simulation"),
        truth=simulation_truth(),
    output:
        csv=results("tables/simulation.csv"),
        md=results("tables/simulation.md"),
    log:
        results("logs/simulation_table.log"),
    benchmark:
        results("benchmarks/simulation_table.tsv")
    params:
        code=code("simulation_table"),
        data=SIMULATED_DATA,
    message:
        "Table of the simulated block's moduli"
    script:
        "../scripts/simulation_table.py"


rule simulation_tracking:
    input:
        steps=SIMULATED_STEPS,
        truth=simulation_truth(),
    output:
        csv=results("tables/simulation_tracking.csv"),
        md=results("tables/simulation_tracking.md"),
    log:
        results("logs/simulation_tracking.log"),
    benchmark:
        results("benchmarks/simulation_tracking.tsv")
    params:
        code=code("simulation_tracking"),
        options=simulation_options(
            "support", "cuts", "corners", "tracking", "variants", "linear"
        ),
        search=SEARCH,
    message:
        "Simulated block: what the estimates owe to the tracker"
    script:
        "../scripts/simulation_tracking.py"


rule simulation_noise:
    input:
        steps=SIMULATED_STEPS,
        truth=simulation_truth(),
    output:
        csv=results("tables/simulation_noise.csv"),
        md=results("tables/simulation_noise.md"),
        png=captioned(results("figures/simulation_noise.png")),
        svg=results("figures/simulation_noise.svg"),
    log:
        results("logs/simulation_noise.log"),
    benchmark:
        results("benchmarks/simulation_noise.tsv")
    params:
        code=code("simulation_noise"),
        options=simulation_options("support", "linear", "noise"),
        search=SEARCH,
        seed=config["seed"],
    message:
        "Simulated block: what noise does to the estimates"
    script:
        "../scripts/simulation_noise.py"


rule table_3_1:
    input:
        object=seen_raw("figure_3_3", "{object}/object.yaml"),
        solid=seen_in("figure_3_3", "{object}/solid.vtu"),
    output:
        csv=results("tables/table_3_1.csv"),
        md=results("tables/table_3_1.md"),
    log:
        results("logs/table_3_1.log"),
    benchmark:
        results("benchmarks/table_3_1.tsv")
    params:
        code=code("table_3_1"),
        capture=shown("figure_3_3")[0],
        probe=HOUSE.probe_of(shown("figure_3_3")[0]["object"]),
        solid=config["solid"],
    message:
        "Table 3.1: node sets of the block"
    script:
        "../scripts/table_3_1.py"


rule figure_3_3:
    input:
        solid=seen_in("figure_3_3", "{object}/solid.vtu"),
        tracked=files_of(shown("figure_3_3"), f"tracked-{TRACKER}.npz")[0],
        fit=seen_in("figure_3_3", "{object}/{sensor}/{capture}/hertz.json"),
    output:
        png=captioned(results("figures/figure_3_3.png")),
        svg=results("figures/figure_3_3.svg"),
    log:
        results("logs/figure_3_3.log"),
    benchmark:
        results("benchmarks/figure_3_3.tsv")
    params:
        code=code("figure_3_3"),
        capture=shown("figure_3_3")[0],
        solid=config["solid"],
    message:
        "Figure 3.3: contact triangle and contact area"
    script:
        "../scripts/figure_3_3.py"


rule figure_3_4:
    input:
        steps=SIMULATED_STEPS,
    output:
        png=captioned(results("figures/figure_3_4.png")),
        svg=results("figures/figure_3_4.svg"),
    log:
        results("logs/figure_3_4.log"),
    benchmark:
        results("benchmarks/figure_3_4.tsv")
    params:
        code=code("figure_3_4"),
    message:
        "Figure 3.4: displacement of the simulated block"
    script:
        "../scripts/figure_3_4.py"


rule figure_3_5:
    input:
        result=results("simulation/linear-exact.json"),
        published=published("simulation"),
        truth=simulation_truth(),
    output:
        png=captioned(results("figures/figure_3_5.png")),
        svg=results("figures/figure_3_5.svg"),
    log:
        results("logs/figure_3_5.log"),
    benchmark:
        results("benchmarks/figure_3_5.tsv")
    params:
        code=code("figure_3_5"),
    message:
        "Figure 3.5: linear method on exact data"
    script:
        "../scripts/figure_3_5.py"


rule figure_3_6:
    input:
        result=results("simulation/linear-exact.json"),
        published=published("simulation"),
        truth=simulation_truth(),
    output:
        png=captioned(results("figures/figure_3_6.png")),
        svg=results("figures/figure_3_6.svg"),
    log:
        results("logs/figure_3_6.log"),
    benchmark:
        results("benchmarks/figure_3_6.tsv")
    params:
        code=code("figure_3_6"),
    message:
        "Figure 3.6: linear method from five starts"
    script:
        "../scripts/figure_3_6.py"


rule figure_3_7:
    input:
        result=results("simulation/linear-tracked.json"),
        published=published("simulation"),
        truth=simulation_truth(),
    output:
        png=captioned(results("figures/figure_3_7.png")),
        svg=results("figures/figure_3_7.svg"),
    log:
        results("logs/figure_3_7.log"),
    benchmark:
        results("benchmarks/figure_3_7.tsv")
    params:
        code=code("figure_3_7"),
    message:
        "Figure 3.7: linear method on tracked data"
    script:
        "../scripts/figure_3_7.py"


rule figure_3_9:
    input:
        result=results("simulation/minimise-tracked-displacement.json"),
        published=published("simulation"),
        truth=simulation_truth(),
    output:
        png=captioned(results("figures/figure_3_9.png")),
        svg=results("figures/figure_3_9.svg"),
    log:
        results("logs/figure_3_9.log"),
    benchmark:
        results("benchmarks/figure_3_9.tsv")
    params:
        code=code("figure_3_9"),
    message:
        "Figure 3.9: displacement error minimisation on tracked data"
    script:
        "../scripts/figure_3_9.py"


rule figure_3_10:
    input:
        steps=SIMULATED_STEPS,
        mismatch=results("simulation/mismatch-tracked-displacement.vtu"),
    output:
        png=captioned(results("figures/figure_3_10.png")),
        svg=results("figures/figure_3_10.svg"),
    log:
        results("logs/figure_3_10.log"),
    benchmark:
        results("benchmarks/figure_3_10.tsv")
    params:
        code=code("figure_3_10"),
    message:
        "Figure 3.10: mismatch on the simulated block"
    script:
        "../scripts/figure_3_10.py"
