# What a person gets of an object of their own: a summary, figures, and a page of them.
import palpate
from palpate.run.own_objects import OwnObjects
from palpate.run.standing import ORIGIN, Standing

OWN = OwnObjects(RUN)
STANDING = Standing(RUN)


onsuccess:
    for page in OWN.pages():
        logger.info(f"Page for a browser: {page}")


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
        make="palpate.report.own_moduli:make_own_moduli",
        title="E and nu of an object",
        caption="Direct estimates straight from clouds and forces, with 95 % intervals: of each capture, and of all"
        " captures with a sensor together (diamonds, the recommended estimate). The value of an"
        " open symbol is not to be trusted; its interval is.",
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


rule own_fit:
    input:
        fitted=OWN.beside_joint("fitted.npz"),
    output:
        png=report(
            RUN.results("{object}/figures/fit.png"),
            caption=CAPTION,
            category="Other objects",
            labels={"Result": "{object}: What was seen and computed"},
        ),
        svg=RUN.results("{object}/figures/fit.svg"),
    log:
        RUN.results("logs/own_fit/{object}.log"),
    benchmark:
        RUN.results("benchmarks/own_fit/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN.names),
    conda:
        "../envs/palpate.yaml"
    params:
        make="palpate.report.fitted_figures:make_fit",
        title="What was seen and computed of an object",
        caption="Force (N) against depth (mm) and motion of the surface (mm) against distance (mm), seen and computed with"
        " the recommended estimate, and the residuals of both.",
        captures=OWN.captures,
        groups=OWN.groups,
    message:
        "Figure of what was seen and computed of {wildcards.object}"
    script:
        "../scripts/stages/artefact.py"


rule own_known:
    input:
        joint=OWN.joint,
        fitted=OWN.beside_joint("fitted.npz"),
    output:
        png=report(
            RUN.results("{object}/figures/known.png"),
            caption=CAPTION,
            category="Other objects",
            labels={"Result": "{object}: What is known of E, nu and the law"},
        ),
        svg=RUN.results("{object}/figures/known.svg"),
    log:
        RUN.results("logs/own_known/{object}.log"),
    benchmark:
        RUN.results("benchmarks/own_known/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN.names),
    conda:
        "../envs/palpate.yaml"
    params:
        make="palpate.report.fitted_figures:make_known",
        title="What is known of E, nu and the law",
        caption="E (kPa) and nu that the tip's depth alone, the surface alone and both explain (95 %), how likely each place"
        " between the laws is, and E over the time after a step, dashed later than the captures.",
        captures=OWN.captures,
        groups=OWN.groups,
    message:
        "Figure of what is known of E, nu and the law of {wildcards.object}"
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
        poses=OWN.files(OWN.captures, "probe_pose.csv"),
        folders=OWN.folders,
        object=RUN.raw("{object}/object.yaml"),
        solid=RUN.results("{object}/solid.vtu"),
        quality=RUN.results("{object}/solid_quality.json"),
        tables=OWN.tables,
        masks=OWN.files(OWN.first, "mask.npz"),
        clouds=OWN.files(OWN.first, "clouds.npz"),
        recorded=OWN.recorded,
        optics=OWN.optics,
        tracked=OWN.files(OWN.first, f"tracked-{RUN.tracker}.npz"),
        fitted=OWN.beside_joint("fitted.npz"),
        style=str(PROJECT / "workflow/report/own_page.css"),
        behaviour=str(PROJECT / "workflow/report/own_page.js"),
        moduli=RUN.results("{object}/figures/moduli.png"),
        fit=RUN.results("{object}/figures/fit.png"),
        known=RUN.results("{object}/figures/known.png"),
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
        first=OWN.first,
        sensors=OWN.sensors,
        groups=OWN.groups,
        points=OWN.points,
        overview=OWN.overview,
        probe=RUN.probe_spec,
        options=RUN.config["direct"]["fit"],
        version=palpate.__version__,
    message:
        "Page of {wildcards.object}"
    script:
        "../scripts/stages/own_report.py"


rule own_data:
    input:
        fitted=OWN.beside_joint("fitted.npz"),
        motions=OWN.files(OWN.of("direct"), "motion.npz"),
        curves=OWN.files(OWN.of("curves"), "curve.json"),
        summary=RUN.results("{object}/summary.csv"),
        budgets=OWN.beside_joint("uncertainty_budget.csv"),
        recorded=OWN.files(OWN.of("direct"), "probe_pose.csv", "force.csv"),
    output:
        force=RUN.results("{object}/data/force.csv"),
        motion=RUN.results("{object}/data/motion.csv"),
        samples=RUN.results("{object}/data/samples.csv"),
        profile=RUN.results("{object}/data/profile.csv"),
        package=RUN.results("{object}/datapackage.json"),
    log:
        RUN.results("logs/own_data/{object}.log"),
    benchmark:
        RUN.results("benchmarks/own_data/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN.names),
    conda:
        "../envs/palpate.yaml"
    params:
        captures=OWN.of("direct"),
        groups=OWN.groups,
        curves=OWN.of("curves"),
    message:
        "Data of {wildcards.object}, with what describes them"
    script:
        "../scripts/stages/own_data.py"
