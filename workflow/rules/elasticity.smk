# Chapters 3 and 5.1: from depth, force and tracked surface to E* and to (E, nu).
rule hertz:
    input:
        tracked=of_capture("tracked.npz"),
        pose=of_capture("probe_pose.csv"),
        force=of_capture("force.csv"),
    output:
        fit=of_capture("hertz.json"),
    log:
        results("logs/hertz/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/hertz/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("hertz"),
        probe=probe_spec,
        options=config["hertz"],
    message:
        "Hertz fit of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/hertz.py"


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
