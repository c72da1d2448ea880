# The virtual lab: captures in the very format that people drop in, and their truth.
def lab_spec(wildcards):
    return HOUSE.lab["objects"][wildcards.object]


def lab_common(wildcards):
    """What all objects of the lab share."""
    return {key: value for key, value in HOUSE.lab.items() if key != "objects"}


def point_of(capture):
    return capture.split("-")[0]


rule lab_contact:
    output:
        ladder=LAB + "/{object}/contact-{point}.npz",
    log:
        RESULTS + "/logs/lab_contact/{object}-{point}.log",
    benchmark:
        RESULTS + "/benchmarks/lab_contact/{object}-{point}.tsv"
    wildcard_constraints:
        object=one_of({capture.object for capture in HOUSE.simulated}),
    params:
        code=code("lab_contact"),
        spec=lab_spec,
        probe=probe_spec,
    message:
        "Lab: pressing the sphere into {wildcards.object} at point {wildcards.point}"
    script:
        "../scripts/lab_contact.py"


rule lab_object:
    output:
        object=RAW + "/{object}/object.yaml",
        template=RAW + "/{object}/template.ply",
        material=LAB + "/{object}/material.json",
    log:
        RESULTS + "/logs/lab_object/{object}.log",
    benchmark:
        RESULTS + "/benchmarks/lab_object/{object}.tsv"
    wildcard_constraints:
        object=one_of({capture.object for capture in HOUSE.simulated}),
    params:
        code=code("lab_object"),
        spec=lab_spec,
    message:
        "Lab: describing {wildcards.object}"
    script:
        "../scripts/lab_object.py"


rule lab_background:
    output:
        background=directory(RAW + "/{object}/{sensor}/background"),
    log:
        RESULTS + "/logs/lab_background/{object}-{sensor}.log",
    benchmark:
        RESULTS + "/benchmarks/lab_background/{object}-{sensor}.tsv"
    wildcard_constraints:
        object=one_of({capture.object for capture in HOUSE.simulated}),
    params:
        code=code("lab_background"),
        common=lab_common,
        spec=lab_spec,
        sensor=sensor_spec,
        probe=probe_spec,
    message:
        "Lab: filming the empty table for {wildcards.object} with the {wildcards.sensor}"
    script:
        "../scripts/lab_background.py"


rule lab_capture:
    input:
        ladder=lambda wildcards: LAB
        + f"/{wildcards.object}/contact-{point_of(wildcards.capture)}.npz",
    output:
        capture=directory(RAW + "/{object}/{sensor}/{capture}"),
        truth=LAB + "/{object}/{sensor}/{capture}/truth.npz",
    log:
        RESULTS + "/logs/lab_capture/{object}-{sensor}-{capture}.log",
    benchmark:
        RESULTS + "/benchmarks/lab_capture/{object}-{sensor}-{capture}.tsv"
    wildcard_constraints:
        object=one_of({capture.object for capture in HOUSE.simulated}),
        capture=r"(?!background$)[A-Za-z0-9]+(-a[0-9]+)?",
    params:
        code=code("lab_capture"),
        common=lab_common,
        spec=lab_spec,
        sensor=sensor_spec,
        probe=probe_spec,
    message:
        "Lab: recording {wildcards.object}, point {wildcards.capture}, with the {wildcards.sensor}"
    script:
        "../scripts/lab_capture.py"
