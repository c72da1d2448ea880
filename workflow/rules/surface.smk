# Section 4.3: the template through the frames of a capture.
rule template:
    input:
        object=raw("{object}/object.yaml"),
        scans=scans_of,
    output:
        template=results("{object}/template.ply"),
    log:
        results("logs/template/{object}.log"),
    benchmark:
        results("benchmarks/template/{object}.tsv")
    wildcard_constraints:
        object=one_of(SCANNED),
    priority: 10
    params:
        code=code("template"),
        content=scans_content,
    message:
        "Template of {wildcards.object} from its laser scans"
    script:
        "../scripts/template.py"


rule solid_mesh:
    input:
        object=raw("{object}/object.yaml"),
        template=template_of,
        kept=kept_mesh,
    output:
        solid=results("{object}/solid.vtu"),
        quality=results("{object}/solid_quality.json"),
    log:
        results("logs/solid_mesh/{object}.log"),
    benchmark:
        results("benchmarks/solid_mesh/{object}.tsv")
    params:
        code=code("solid_mesh"),
    message:
        "Solid mesh of {wildcards.object}"
    script:
        "../scripts/solid_mesh.py"


rule align:
    input:
        object=raw("{object}/object.yaml"),
        template=template_of,
        cloud=first_cloud_of,
        pose=of_capture("probe_pose.csv"),
        force=of_capture("force.csv"),
        plane=results("{object}/{sensor}/support_plane.json"),
    output:
        alignment=of_capture("alignment.json"),
    log:
        results("logs/align/{object}-{sensor}-{capture}.log"),
    benchmark:
        results("benchmarks/align/{object}-{sensor}-{capture}.tsv")
    params:
        code=code("align"),
        probe=probe_spec,
        options=config["tracking"]["alignment"],
        onset_force_n=config["hertz"]["onset_force_n"],
    message:
        "Aligning {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/align.py"


rule track:
    input:
        object=raw("{object}/object.yaml"),
        template=template_of,
        alignment=of_capture("alignment.json"),
        solid=results("{object}/solid.vtu"),
        clouds=of_capture("clouds.npz"),
        pose=of_capture("probe_pose.csv"),
        force=of_capture("force.csv"),
    output:
        tracked=of_capture("tracked-{tracker}.npz"),
        series=of_capture("tracked-{tracker}.vtkhdf"),
        description=of_capture("tracked-{tracker}.json"),
    log:
        results("logs/track/{object}-{sensor}-{capture}-{tracker}.log"),
    benchmark:
        results("benchmarks/track/{object}-{sensor}-{capture}-{tracker}.tsv")
    params:
        code=code("track"),
        probe=probe_spec,
        options=tracker_options,
    message:
        "Tracking {wildcards.object}, {wildcards.sensor}, {wildcards.capture} ({wildcards.tracker})"
    script:
        "../scripts/track.py"
