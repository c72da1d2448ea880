# From clouds and forces to (E, nu) without a tracked surface.
rule indentation:
    input:
        object=raw("{object}/object.yaml"),
        template=template_of,
        solid=results("{object}/solid.vtu"),
        image=image_of,
    output:
        model=results("{object}/indentation-{point}.npz"),
    log:
        results("logs/indentation/{object}-{point}.log"),
    benchmark:
        results("benchmarks/indentation/{object}-{point}.tsv")
    params:
        code=code("indentation"),
        probe=probe_spec,
        options=config["direct"]["model"],
        mirrors=mirrors_of,
    message:
        "Look-up of {wildcards.object}, pressed at {wildcards.point}"
    script:
        "../scripts/indentation.py"


rule surface_motion:
    input:
        object=raw("{object}/object.yaml"),
        template=template_of,
        alignment=of_capture("alignment.json"),
        clouds=of_capture("clouds.npz"),
        pose=of_capture("probe_pose.csv"),
        force=of_capture("force.csv"),
    output:
        motion=of_capture("motion.npz"),
    log:
        results("logs/surface_motion/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/surface_motion/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("surface_motion"),
        probe=probe_spec,
        sensor=sensor_spec,
        onset_force_n=config["hertz"]["onset_force_n"],
        options=config["direct"]["observation"],
    message:
        "Motion of the surface of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/surface_motion.py"


rule direct:
    input:
        **direct_files(of_one),
    output:
        estimate=of_capture("direct.json"),
    log:
        results("logs/direct/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/direct/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("direct"),
        probe=probe_spec,
        captures=of_one,
        seed=config["seed"],
        options=config["direct"]["fit"],
    message:
        "Direct estimate of {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/direct.py"


rule direct_object:
    input:
        **direct_files(of_all),
    output:
        estimate=results("{object}/{sensor}/direct.json"),
    log:
        results("logs/direct_object/{object}-{sensor}.log"),
    benchmark:
        results("benchmarks/direct_object/{object}-{sensor}.tsv")
    params:
        code=code("direct"),
        probe=probe_spec,
        captures=of_all,
        seed=config["seed"],
        options=config["direct"]["fit"],
    message:
        "Direct estimate of {wildcards.object}, {wildcards.sensor}: all captures together"
    script:
        "../scripts/direct.py"


rule accuracy:
    input:
        summary=results("summary.csv"),
        materials=lab_materials(),
    output:
        csv=results("tables/accuracy.csv"),
        md=results("tables/accuracy.md"),
        summary=results("tables/accuracy_summary.csv"),
        summary_md=results("tables/accuracy_summary.md"),
    log:
        results("logs/accuracy.log"),
    benchmark:
        results("benchmarks/accuracy.tsv")
    params:
        code=code("accuracy"),
    message:
        "E and nu of all methods against the lab's truth"
    script:
        "../scripts/accuracy.py"


rule direct_moduli:
    input:
        direct=per_direct(of_capture("direct.json")),
        joint=joint_estimates(),
        materials=lab_materials(),
    output:
        png=captioned(results("figures/direct_moduli.png")),
        svg=results("figures/direct_moduli.svg"),
    log:
        results("logs/direct_moduli.log"),
    benchmark:
        results("benchmarks/direct_moduli.tsv")
    params:
        code=code("direct_moduli"),
        captures=HOUSE.described(direct=True),
        groups=direct_groups(),
    message:
        "Figure of the direct estimates"
    script:
        "../scripts/direct_moduli.py"
