# What a person gets of an object of their own: a summary, figures, and a page of them.
from palpate.run.own_objects import OwnObjects
from palpate.run.standing import ORIGIN, Standing

OWN = OwnObjects(RUN)
STANDING = Standing(RUN)


rule own_summary:
    input:
        fits=OWN.files(OWN.of("fitted"), "hertz.json"),
        results=OWN.minima,
        direct=OWN.files(OWN.of("direct"), "direct.json"),
        joint=OWN.joint,
        curves=OWN.files(OWN.of("curves"), "curve.json"),
    output:
        csv=RUN.results("{object}/summary.csv"),
        origin=RUN.results(f"{{object}}/{ORIGIN}"),
    log:
        RUN.results("logs/own_summary/{object}.log"),
    benchmark:
        RUN.results("benchmarks/own_summary/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN.summed),
    conda:
        "../envs/palpate.yaml"
    params:
        captures=OWN.of("fitted"),
        minimised=OWN.of("minimised"),
        estimated=OWN.of("direct"),
        groups=OWN.groups,
        curves=OWN.of("curves"),
        errors=RUN.errors,
        origin=STANDING.origin_of,
    message:
        "Summary of {wildcards.object}: every sensor, capture and method"
    script:
        "../scripts/stages/summary.py"


rule own_moduli:
    input:
        direct=OWN.files(OWN.captures, "direct.json"),
        joint=OWN.joint,
        materials=[],
    output:
        png=report(
            RUN.results("{object}/figures/moduli.png"),
            caption=CAPTION,
            category="Other objects",
            labels={"Result": "{object}: E and nu of an object"},
        ),
        svg=RUN.results("{object}/figures/moduli.svg"),
    log:
        RUN.results("logs/own_moduli/{object}.log"),
    benchmark:
        RUN.results("benchmarks/own_moduli/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN.names),
    conda:
        "../envs/palpate.yaml"
    params:
        make="palpate.report.moduli_figure:make_direct_moduli",
        title="E and nu of an object",
        caption="Direct estimates straight from clouds and forces, with 95 % intervals: each capture, and all"
        " captures with a sensor together (the recommended estimate). Open symbols are not identified.",
        captures=OWN.captures,
        groups=OWN.groups,
    message:
        "Figure of E and nu of {wildcards.object}"
    script:
        "../scripts/stages/artefact.py"


rule own_hertz_fit:
    input:
        fits=OWN.files(OWN.fitted, "hertz.json"),
    output:
        png=report(
            RUN.results("{object}/figures/hertz_fit.png"),
            caption=CAPTION,
            category="Other objects",
            labels={"Result": "{object}: Hertz fit of an object"},
        ),
        svg=RUN.results("{object}/figures/hertz_fit.svg"),
    log:
        RUN.results("logs/own_hertz_fit/{object}.log"),
    benchmark:
        RUN.results("benchmarks/own_hertz_fit/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN.names),
    conda:
        "../envs/palpate.yaml"
    params:
        make="palpate.report.hertz_figures:make_hertz_fits",
        title="Hertz fit of an object",
        caption="Hertz model (Eq. 5.1) fitted to force (N) and depth (mm) of the first captures, with a contact"
        " point that is free beside it, and what both leave (mN).",
        captures=OWN.fitted,
    message:
        "Figure of the Hertz fit of {wildcards.object}"
    script:
        "../scripts/stages/artefact.py"


rule own_surface:
    input:
        tracked=OWN.files(OWN.first, f"tracked-{RUN.tracker}.npz"),
        clouds=OWN.files(OWN.first, "clouds.npz"),
        fits=OWN.files(OWN.first, "hertz.json"),
        recorded=OWN.recorded,
    output:
        png=report(
            RUN.results("{object}/figures/surface.png"),
            caption=CAPTION,
            category="Other objects",
            labels={"Result": "{object}: Tracked surface of an object"},
        ),
        svg=RUN.results("{object}/figures/surface.svg"),
    log:
        RUN.results("logs/own_surface/{object}.log"),
    benchmark:
        RUN.results("benchmarks/own_surface/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN.names),
    conda:
        "../envs/palpate.yaml"
    params:
        make="palpate.report.surface_figures:make_tracked_surface",
        title="Tracked surface of an object",
        caption="What the camera sees in the deepest frame of the first capture with each sensor, the tracked"
        " surface, and a section through the dent (mm).",
        captures=OWN.first,
        sensors=OWN.sensors,
    message:
        "Figure of the tracked surface of {wildcards.object}"
    script:
        "../scripts/stages/artefact.py"


rule own_report:
    input:
        summary=RUN.results("{object}/summary.csv"),
        fits=OWN.files(OWN.captures, "hertz.json"),
        direct=OWN.files(OWN.captures, "direct.json"),
        joint=OWN.joint,
        moduli=RUN.results("{object}/figures/moduli.png"),
        hertz_fit=RUN.results("{object}/figures/hertz_fit.png"),
        surface=RUN.results("{object}/figures/surface.png"),
    output:
        page=RUN.results("{object}/report.html"),
    log:
        RUN.results("logs/own_report/{object}.log"),
    benchmark:
        RUN.results("benchmarks/own_report/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN.names),
    conda:
        "../envs/palpate.yaml"
    params:
        captures=OWN.captures,
        groups=OWN.groups,
    message:
        "Page of {wildcards.object}"
    script:
        "../scripts/stages/own_report.py"
