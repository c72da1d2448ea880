# From clouds and forces to (E, nu) without a tracked surface.
rule indentation:
    input:
        object=raw("{object}/object.yaml"),
        template=template_of,
        solid=results("{object}/solid.vtu"),
    output:
        model=results("{object}/indentation-{point}.npz"),
    log:
        results("logs/indentation/{object}-{point}.log"),
    benchmark:
        results("benchmarks/indentation/{object}-{point}.tsv")
    params:
        code=code("indentation"),
        probe=probe_spec,
        options=model_options,
    message:
        "Look-up of {wildcards.object}, pressed at {wildcards.point}"
    script:
        "../scripts/indentation.py"
