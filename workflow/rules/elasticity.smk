# Chapter 3: from force and tracked surface to (E, nu).
rule minimise:
    input:
        object=raw("{object}/object.yaml"),
        solid=results("{object}/solid.vtu"),
        tracked=of_capture(f"tracked-{TRACKER}.npz"),
        force=of_capture("force.csv"),
        fit=of_capture("hertz.json"),
    output:
        result=of_capture("minimise-{error}.json"),
        mismatch=of_capture("mismatch-{error}.vtu"),
    log:
        results("logs/minimise/{object}-{sensor}-{capture}-{error}.log"),
    benchmark:
        results("benchmarks/minimise/{object}-{sensor}-{capture}-{error}.tsv")
    params:
        code=code("minimise"),
        probe=probe_spec,
        solid=config["solid"],
        options=load_and_search,
    message:
        "Error minimisation ({wildcards.error}) of {wildcards.object}, {wildcards.sensor}, "
        "{wildcards.capture}"
    script:
        "../scripts/minimise.py"


rule poisson_profiles:
    input:
        results=per_tracked(of_capture("minimise-{error}.json"), error=ERRORS),
    output:
        png=captioned(results("figures/poisson_profiles.png")),
        svg=results("figures/poisson_profiles.svg"),
    log:
        results("logs/poisson_profiles.log"),
    benchmark:
        results("benchmarks/poisson_profiles.tsv")
    params:
        code=code("poisson_profiles"),
        captures=HOUSE.described(tracked=True),
        errors=ERRORS,
    message:
        "Profile of the error over Poisson's ratio"
    script:
        "../scripts/poisson_profiles.py"
