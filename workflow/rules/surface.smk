# Section 4.3: the template through the frames of a capture.
from functools import partial

from thesis.tracker.options import job_options


rule template:
    input:
        object=RUN.raw("{object}/object.yaml"),
        scans=RUN.scans_of,
    output:
        template=RUN.results("{object}/template.ply"),
    log:
        RUN.results("logs/template/{object}.log"),
    benchmark:
        RUN.results("benchmarks/template/{object}.tsv")
    wildcard_constraints:
        object=one_of(RUN.scanned),
    priority: 10
    message:
        "Template of {wildcards.object} from its laser scans"
    script:
        "../scripts/stages/template.py"


rule solid_mesh:
    input:
        object=RUN.raw("{object}/object.yaml"),
        template=RUN.template_of,
        kept=RUN.kept_mesh,
    output:
        solid=RUN.results("{object}/solid.vtu"),
        quality=RUN.results("{object}/solid_quality.json"),
    log:
        RUN.results("logs/solid_mesh/{object}.log"),
    benchmark:
        RUN.results("benchmarks/solid_mesh/{object}.tsv")
    message:
        "Solid mesh of {wildcards.object}"
    script:
        "../scripts/stages/solid_mesh.py"


rule align:
    input:
        object=RUN.raw("{object}/object.yaml"),
        template=RUN.template_of,
        cloud=RUN.first_cloud_of,
        pose=RUN.of_capture("probe_pose.csv"),
        force=RUN.of_capture("force.csv"),
        plane=RUN.results("{object}/{sensor}/support_plane.json"),
    output:
        alignment=RUN.of_capture("alignment.json"),
    log:
        RUN.results("logs/align/{object}-{sensor}-{capture}.log"),
    benchmark:
        RUN.results("benchmarks/align/{object}-{sensor}-{capture}.tsv")
    params:
        probe=RUN.probe_spec,
        options=RUN.config["tracking"]["alignment"],
        onset_force_n=RUN.config["hertz"]["onset_force_n"],
    message:
        "Aligning {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/stages/align.py"


rule track:
    input:
        object=RUN.raw("{object}/object.yaml"),
        template=RUN.template_of,
        alignment=RUN.of_capture("alignment.json"),
        solid=RUN.results("{object}/solid.vtu"),
        clouds=RUN.of_capture("clouds.npz"),
        pose=RUN.of_capture("probe_pose.csv"),
        force=RUN.of_capture("force.csv"),
    output:
        tracked=RUN.of_capture("tracked-{tracker}.npz"),
        series=directory(RUN.of_capture("tracked-{tracker}-series")),
        description=RUN.of_capture("tracked-{tracker}.json"),
    log:
        RUN.results("logs/track/{object}-{sensor}-{capture}-{tracker}.log"),
    benchmark:
        RUN.results("benchmarks/track/{object}-{sensor}-{capture}-{tracker}.tsv")
    params:
        probe=RUN.probe_spec,
        options=partial(job_options, RUN.config["tracking"]),
    message:
        "Tracking {wildcards.object}, {wildcards.sensor}, {wildcards.capture} ({wildcards.tracker})"
    script:
        "../scripts/stages/track.py"
