# Chapter 3: from force and tracked surface to (E, nu).
rule minimise:
    input:
        object=raw("{object}/object.yaml"),
        solid=results("{object}/solid.vtu"),
        tracked=of_capture("tracked.npz"),
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
        options=config["minimise"],
    message:
        "Error minimisation ({wildcards.error}) of {wildcards.object}, {wildcards.sensor}, "
        "{wildcards.capture}"
    script:
        "../scripts/minimise.py"
