# Section 4.3: the template through the frames of a capture.
KEPT_MESHES = Path(HOUSE.paths["meshes"])


def template_of(wildcards):
    return f"{RAW}/{wildcards.object}/{HOUSE.template_file(wildcards.object)}"


def kept_mesh(wildcards):
    """The object's kept solid mesh where there is one (pytetwild never repeats itself)."""
    kept = KEPT_MESHES / f"{wildcards.object}.vtu"
    return str(kept) if kept.is_file() else []


rule solid_mesh:
    input:
        object=RAW + "/{object}/object.yaml",
        template=template_of,
        kept=kept_mesh,
    output:
        solid=RESULTS + "/{object}/solid.vtu",
    log:
        RESULTS + "/logs/solid_mesh/{object}.log",
    benchmark:
        RESULTS + "/benchmarks/solid_mesh/{object}.tsv"
    params:
        code=code("solid_mesh"),
    message:
        "Solid mesh of {wildcards.object}"
    script:
        "../scripts/solid_mesh.py"


rule track:
    input:
        object=RAW + "/{object}/object.yaml",
        template=template_of,
        clouds=CAPTURE + "/clouds.npz",
        pose=CAPTURE + "/probe_pose.csv",
        force=CAPTURE + "/force.csv",
        plane=RESULTS + "/{object}/{sensor}/support_plane.json",
    output:
        tracked=CAPTURE + "/tracked.npz",
    log:
        RESULTS + "/logs/track/{object}-{sensor}-{capture}.log",
    benchmark:
        RESULTS + "/benchmarks/track/{object}-{sensor}-{capture}.tsv"
    params:
        code=code("track"),
        probe=probe_spec,
        options=config["tracking"],
        onset=config["hertz"],
    message:
        "Tracking {wildcards.object}, {wildcards.sensor}, {wildcards.capture}"
    script:
        "../scripts/track.py"
