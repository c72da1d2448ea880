# From forces, tracked surfaces and clouds to E and nu.
rule hertz:
    input:
        object=RUN.raw("{object}/object.yaml"),
        template=RUN.template_of,
        alignment=RUN.of_capture("alignment.json"),
        pose=RUN.of_capture("probe_pose.csv"),
        force=RUN.of_capture("force.csv"),
        clock=RUN.of_capture("clock.json"),
    output:
        fit=RUN.of_capture("hertz.json"),
    log:
        RUN.results("logs/hertz/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/hertz/{object}-{sensor}-{capture}.tsv")
    params:
        probe=RUN.probe_spec,
        options=RUN.config["hertz"],
        rig=RUN.config["direct"]["fit"]["rig"],
    message:
        "Hertz fit of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/stages/hertz.py"


rule minimise:
    input:
        object=RUN.raw("{object}/object.yaml"),
        solid=RUN.results("{object}/solid.vtu"),
        tracked=RUN.of_capture(f"tracked-{RUN.tracker}.npz"),
        force=RUN.of_capture("force.csv"),
        fit=RUN.of_capture("hertz.json"),
    output:
        result=RUN.of_capture("minimise-{error}.json"),
        mismatch=RUN.of_capture("mismatch-{error}.vtu"),
    log:
        RUN.results("logs/minimise/{object}-{sensor}-{capture}-{error}.log"),
    benchmark:
        RUN.results("benchmarks/minimise/{object}-{sensor}-{capture}-{error}.tsv")
    params:
        probe=RUN.probe_spec,
        solid=RUN.config["solid"],
        options=RUN.search_of,
    message:
        "Error minimisation ({wildcards.error}) of {wildcards.object}, {wildcards.sensor}, "
        "{wildcards.capture}"
    script:
        "../scripts/stages/minimise.py"


rule indentation:
    input:
        object=RUN.raw("{object}/object.yaml"),
        template=RUN.template_of,
        solid=RUN.results("{object}/solid.vtu"),
        image=RUN.image_of,
    output:
        model=RUN.results("{object}/indentation-{point}.npz"),
    log:
        RUN.results("logs/indentation/{object}-{point}.log"),
    benchmark:
        RUN.results("benchmarks/indentation/{object}-{point}.tsv")
    params:
        probe=RUN.probe_spec,
        options=RUN.config["direct"]["model"],
        mirrors=RUN.mirrors_of,
    message:
        "Indentation table of {wildcards.object}, pressed at {wildcards.point}"
    script:
        "../scripts/stages/indentation.py"


rule surface_motion:
    input:
        object=RUN.raw("{object}/object.yaml"),
        optics=RUN.optics_of,
        template=RUN.template_of,
        alignment=RUN.of_capture("alignment.json"),
        clouds=RUN.of_capture("clouds.npz"),
        pose=RUN.of_capture("probe_pose.csv"),
        force=RUN.of_capture("force.csv"),
    output:
        motion=RUN.of_capture("motion.npz"),
    log:
        RUN.results("logs/surface_motion/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/surface_motion/{object}-{sensor}-{capture}.tsv")
    params:
        probe=RUN.probe_spec,
        sensor=RUN.sensor_spec,
        onset_force_n=RUN.config["hertz"]["onset_force_n"],
        options=RUN.config["direct"]["observation"],
    message:
        "Motion of the surface of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/stages/surface_motion.py"


rule direct:
    input:
        **RUN.direct_files(lambda wildcards: [wildcards.capture]),
    output:
        estimate=RUN.of_capture("direct.json"),
    log:
        RUN.results("logs/direct/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/direct/{object}-{sensor}-{capture}.tsv")
    params:
        probe=RUN.probe_spec,
        sensor=RUN.sensor_spec,
        captures=lambda wildcards: [wildcards.capture],
        options=RUN.config["direct"]["fit"],
    message:
        "Direct estimate of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/stages/direct.py"


rule direct_object:
    input:
        **RUN.direct_files(RUN.together),
    output:
        estimate=RUN.results("{object}/{sensor}/direct.json"),
        budget=RUN.results("{object}/{sensor}/uncertainty_budget.csv"),
        fitted=RUN.results("{object}/{sensor}/fitted.npz"),
    log:
        RUN.results("logs/direct_object/{object}-{sensor}.log"),
    benchmark:
        RUN.results("benchmarks/direct_object/{object}-{sensor}.tsv")
    params:
        probe=RUN.probe_spec,
        sensor=RUN.sensor_spec,
        captures=RUN.together,
        options=RUN.config["direct"]["fit"],
    message:
        "Direct estimate of {wildcards.object}, {wildcards.sensor}: all captures together"
    script:
        "../scripts/stages/direct.py"


# Force and position of a robot or a bench: raw/<object>/<point>.csv.
rule curve:
    input:
        object=RUN.raw("{object}/object.yaml"),
        curve=RUN.raw("{object}/{capture}.csv"),
        table=lambda wildcards: RUN.table(wildcards.object, wildcards.capture),
    output:
        estimate=RUN.results("{object}/curve/{capture}/curve.json"),
    log:
        RUN.results("logs/curve/{object}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/curve/{object}-{capture}.tsv")
    params:
        probe=RUN.probe_spec,
        options=RUN.config["direct"]["fit"],
    message:
        "E of {wildcards.object} by its curve {wildcards.capture}"
    script:
        "../scripts/stages/curve.py"
