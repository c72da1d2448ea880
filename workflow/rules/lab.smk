# The virtual lab: captures in the very format that people drop in, and their truth.


rule lab_contact:
    input:
        form=drawn_form,
    output:
        ladder=truth("{object}/contact-{point}.npz"),
    log:
        results("logs/lab_contact/{object}-{point}.log"),
    benchmark:
        results("benchmarks/lab_contact/{object}-{point}.tsv")
    wildcard_constraints:
        object=one_of(MODELLED),
    params:
        code=code("lab_contact"),
        spec=lab_mechanics,
        probe=lab_probe,
    message:
        "Lab: pressing the sphere into {wildcards.object} at point {wildcards.point}"
    script:
        "../scripts/lab_contact.py"


rule lab_object:
    output:
        object=raw("{object}/object.yaml"),
        material=truth("{object}/material.json"),
    log:
        results("logs/lab_object/{object}.log"),
    benchmark:
        results("benchmarks/lab_object/{object}.tsv")
    wildcard_constraints:
        object=one_of(LAB_OBJECTS),
    params:
        code=code("lab_object"),
        spec=lab_spec,
    message:
        "Lab: describing {wildcards.object}"
    script:
        "../scripts/lab_object.py"


rule lab_template:
    input:
        form=drawn_form,
    output:
        template=raw("{object}/template.ply"),
    log:
        results("logs/lab_template/{object}.log"),
    benchmark:
        results("benchmarks/lab_template/{object}.tsv")
    wildcard_constraints:
        object=one_of(set(LAB_OBJECTS) - set(SCANNED)),
    params:
        code=code("lab_template"),
        shape=lab_shape,
    message:
        "Lab: template of {wildcards.object}"
    script:
        "../scripts/lab_template.py"


rule lab_scans:
    input:
        form=drawn_form,
    output:
        scans=directory(raw("{object}/scans")),
    log:
        results("logs/lab_scans/{object}.log"),
    benchmark:
        results("benchmarks/lab_scans/{object}.tsv")
    wildcard_constraints:
        object=one_of(LAB_OBJECTS),
    params:
        code=code("lab_scans"),
        laser=laser_spec,
        shape=lab_shape,
    message:
        "Lab: scanning {wildcards.object} with the laser"
    script:
        "../scripts/lab_scans.py"


rule lab_background:
    input:
        form=drawn_form,
    output:
        background=directory(raw("{object}/{sensor}/background")),
    log:
        results("logs/lab_background/{object}-{sensor}.log"),
    benchmark:
        results("benchmarks/lab_background/{object}-{sensor}.tsv")
    wildcard_constraints:
        object=one_of(LAB_OBJECTS),
    params:
        code=code("lab_background"),
        common=lab_common,
        spec=lab_spec,
        sensor=sensor_spec,
    message:
        "Lab: filming the empty table for {wildcards.object} with the {wildcards.sensor}"
    script:
        "../scripts/lab_background.py"


rule lab_capture:
    input:
        form=drawn_form,
        ladder=ladder_of,
    output:
        capture=directory(raw("{object}/{sensor}/{capture}")),
        truth=truth("{object}/{sensor}/{capture}/truth.npz"),
    log:
        results("logs/lab_capture/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/lab_capture/{object}-{sensor}-{capture}.tsv")
    wildcard_constraints:
        object=one_of(LAB_OBJECTS),
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


rule lab_experiment:
    input:
        ladder=experiment_ladder,
    output:
        recording=directory(raw("sensors/{recording}")),
        truth=truth("sensors/{recording}.npz"),
    log:
        results("logs/lab_experiment/{recording}.log"),
    benchmark:
        results("benchmarks/lab_experiment/{recording}.tsv")
    wildcard_constraints:
        recording=one_of(HOUSE.lab_experiments),
    params:
        code=code("lab_experiment"),
        common=lab_common,
        experiment=experiment_spec,
        sensor=experiment_sensor,
        probe=experiment_probe,
    message:
        "Lab: experiment {wildcards.recording}"
    script:
        "../scripts/lab_experiment.py"


if HOUSE.lab and "simulated_block" in HOUSE.lab:

    rule lab_simulated_block:
        input:
            mesh=simulated_mesh,
        output:
            steps=raw("simulations/foam_block.npz"),
            truth=truth("simulations/foam_block.json"),
        log:
            results("logs/lab_simulated_block.log"),
        benchmark:
            results("benchmarks/lab_simulated_block.tsv")
        params:
            code=code("lab_simulated_block"),
            spec=simulated_spec,
        message:
            "Lab: linear FEM of the foam block of Section 3.3.2"
        script:
            "../scripts/lab_simulated_block.py"
