# Chapters 3 and 5.1: from depth, force and tracked surface to E* and to (E, nu).
rule hertz:
    input:
        tracked=CAPTURE + "/tracked.npz",
        pose=CAPTURE + "/probe_pose.csv",
        force=CAPTURE + "/force.csv",
    output:
        fit=CAPTURE + "/hertz.json",
    log:
        RESULTS + "/logs/hertz/{object}-{sensor}-{capture}.log",
    benchmark:
        RESULTS + "/benchmarks/hertz/{object}-{sensor}-{capture}.tsv"
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
        object=RAW + "/{object}/object.yaml",
        solid=RESULTS + "/{object}/solid.vtu",
        tracked=CAPTURE + "/tracked.npz",
        force=CAPTURE + "/force.csv",
        fit=CAPTURE + "/hertz.json",
    output:
        result=CAPTURE + "/minimise-{error}.json",
        mismatch=CAPTURE + "/mismatch-{error}.vtu",
    log:
        RESULTS + "/logs/minimise/{object}-{sensor}-{capture}-{error}.log",
    benchmark:
        RESULTS + "/benchmarks/minimise/{object}-{sensor}-{capture}-{error}.tsv"
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
