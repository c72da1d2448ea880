# All captures are checked before the first object's run; then each object is a run of its own.
PLAN = Plan(logger, begins=run_begins)


onstart:
    try:
        begin_objects()
    except ValueError as error:
        refuse(error)
    PLAN.show()
    be_brief(logger, len(workflow.dag))


onerror:
    logger.info(GOES_ON)


rule object_check:
    input:
        object=f"{RAW}/{{object}}/object.yaml",
    output:
        lines=of_object(".checked.txt"),
    log:
        f"{RESULTS}/logs/object_check/{{object}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/object_check/{{object}}.tsv"
    resources:
        mem_mb=600,
        runtime=5,
    params:
        code=code("object_check"),
        content=content,
        sensors=sensor_specs,
        probes=probe_specs,
    message:
        "Checking the captures of {wildcards.object}"
    script:
        "../scripts/object_check.py"


rule objects_checked:
    input:
        lines=per_object(of_object(".checked.txt")),
    output:
        summary=f"{RESULTS}/objects/checked.txt",
    log:
        f"{RESULTS}/logs/objects_checked.log",
    benchmark:
        f"{RESULTS}/benchmarks/objects_checked.tsv"
    localrule: True
    params:
        code=code("objects_checked"),
    message:
        "Nothing is wrong with any capture"
    script:
        "../scripts/objects_checked.py"


rule object_study:
    input:
        object=f"{RAW}/{{object}}/object.yaml",
        lines=of_object(".checked.txt"),
        checked=ancient(f"{RESULTS}/objects/checked.txt"),
    output:
        summary=of_object(".csv"),
    log:
        f"{RESULTS}/logs/object_study/{{object}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/object_study/{{object}}.tsv"
    threads: 4
    resources:
        mem_mb=memory,
        runtime=minutes,
    params:
        origin=origin,
        content=content,
        folder=of_object(""),
        wanted=wanted,
    message:
        "Object {wildcards.object}: all its captures"
    script:
        "../scripts/object_study.py"


rule objects_summary:
    input:
        summaries=per_object(of_object(".csv")),
    output:
        csv=f"{RESULTS}/objects.csv",
    log:
        f"{RESULTS}/logs/objects_summary.log",
    benchmark:
        f"{RESULTS}/benchmarks/objects_summary.tsv"
    localrule: True
    params:
        code=code("objects_summary"),
    message:
        "Summary of all objects"
    script:
        "../scripts/objects_summary.py"
