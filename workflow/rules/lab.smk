# The virtual lab: captures in the very format that people drop in, and their truth.
from virtual_lab.rules import LabRules

LAB = LabRules(RUN)


rule lab:
    input:
        LAB.outputs(),


rule lab_contact:
    input:
        form=LAB.form,
    output:
        load_steps=RUN.truth("{object}/contact-{point}.npz"),
    log:
        RUN.results("logs/lab_contact/{object}-{point}.log"),
    benchmark:
        RUN.results("benchmarks/lab_contact/{object}-{point}.tsv")
    wildcard_constraints:
        object=one_of(LAB.modelled),
        point=CAPTURE_NAME.pattern,
    params:
        spec=LAB.mechanics,
        probe=LAB.probe,
    message:
        "Lab: indenting {wildcards.object} at point {wildcards.point}"
    script:
        "../scripts/stages/lab_contact.py"


rule lab_object:
    output:
        object=RUN.raw("{object}/object.yaml"),
        material=RUN.truth("{object}/material.json"),
    log:
        RUN.results("logs/lab_object/{object}.log"),
    benchmark:
        RUN.results("benchmarks/lab_object/{object}.tsv")
    wildcard_constraints:
        object=one_of(RUN.lab_objects),
    params:
        spec=LAB.spec,
        errors=LAB.written,
    message:
        "Lab: describing {wildcards.object}"
    script:
        "../scripts/stages/lab_object.py"


rule lab_template:
    input:
        form=LAB.form,
    output:
        template=RUN.raw("{object}/template.ply"),
    log:
        RUN.results("logs/lab_template/{object}.log"),
    benchmark:
        RUN.results("benchmarks/lab_template/{object}.tsv")
    wildcard_constraints:
        object=one_of(LAB.templates),
    params:
        shape=LAB.shape,
        errors=LAB.written,
    message:
        "Lab: template of {wildcards.object}"
    script:
        "../scripts/stages/lab_template.py"


rule lab_scans:
    input:
        form=LAB.form,
    output:
        scans=directory(RUN.raw("{object}/scans")),
    log:
        RUN.results("logs/lab_scans/{object}.log"),
    benchmark:
        RUN.results("benchmarks/lab_scans/{object}.tsv")
    wildcard_constraints:
        object=one_of(RUN.lab_objects),
    params:
        laser=LAB.laser,
        shape=LAB.shape,
    message:
        "Lab: scanning {wildcards.object} with the laser"
    script:
        "../scripts/stages/lab_scans.py"


rule lab_background:
    input:
        form=LAB.form,
    output:
        background=directory(RUN.raw("{object}/{sensor}/background")),
    log:
        RUN.results("logs/lab_background/{object}-{sensor}.log"),
    benchmark:
        RUN.results("benchmarks/lab_background/{object}-{sensor}.tsv")
    wildcard_constraints:
        object=one_of(RUN.lab_objects),
    params:
        common=LAB.common,
        spec=LAB.spec,
        sensor=LAB.sensor,
    message:
        "Lab: recording the empty table for {wildcards.object} with the {wildcards.sensor}"
    script:
        "../scripts/stages/lab_background.py"


rule lab_capture:
    input:
        form=LAB.form,
        load_steps=LAB.load_steps,
    output:
        capture=directory(RUN.raw("{object}/{sensor}/{capture}")),
        truth=RUN.truth("{object}/{sensor}/{capture}/truth.npz"),
    log:
        RUN.results("logs/lab_capture/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/lab_capture/{object}-{sensor}-{capture}.tsv")
    wildcard_constraints:
        object=one_of(RUN.lab_objects),
        capture=r"(?!background$)[A-Za-z0-9]+(-a[0-9]+)?",
    params:
        common=LAB.common,
        spec=LAB.recorded,
        place=LAB.place,
        sensor=LAB.sensor,
        probe=RUN.probe_spec,
    message:
        "Lab: recording {wildcards.object}, point {wildcards.capture}, with the {wildcards.sensor}"
    script:
        "../scripts/stages/lab_capture.py"


rule lab_experiment:
    input:
        load_steps=LAB.experiment_load_steps,
    output:
        recording=directory(RUN.raw("sensors/{recording}")),
        truth=RUN.truth("sensors/{recording}.npz"),
    log:
        RUN.results("logs/lab_experiment/{recording}.log"),
    benchmark:
        RUN.results("benchmarks/lab_experiment/{recording}.tsv")
    wildcard_constraints:
        recording=one_of(RUN.lab_experiments),
    params:
        common=LAB.common,
        experiment=LAB.experiment,
        sensor=LAB.experiment_sensor,
        probe=LAB.experiment_probe,
    message:
        "Lab: experiment {wildcards.recording}"
    script:
        "../scripts/stages/lab_experiment.py"


if LAB.simulates:

    rule lab_simulated_block:
        input:
            mesh=RUN.lab["simulated_block"]["mesh"],
        output:
            steps=RUN.raw("simulations/foam_block.npz"),
            truth=RUN.truth("simulations/foam_block.json"),
        log:
            RUN.results("logs/lab_simulated_block.log"),
        benchmark:
            RUN.results("benchmarks/lab_simulated_block.tsv")
        params:
            spec=RUN.lab["simulated_block"],
        message:
            "Lab: linear FEM of the foam block of Section 3.3.2"
        script:
            "../scripts/stages/lab_simulated_block.py"
