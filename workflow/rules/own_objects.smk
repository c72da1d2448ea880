# What a person gets of an object of their own: a summary, figures, and a page of them.
import palpate
from palpate.report.own_figures import OWN_FIGURES
from palpate.workflow.own_objects import ORIGIN, OwnObjects, Standing

OWN = OwnObjects(RUN)
STANDING = Standing(RUN)


onsuccess:
    for page in OWN.pages():
        logger.info(f"Page for a browser: {page}")


rule own_summary:
    input:
        fits=OWN.files(OWN.of("fitted"), "hertz.json"),
        results=lambda wildcards: RUN.minima_of(OWN.captures(wildcards)),
        direct=OWN.files(OWN.of("direct"), "direct.json"),
        joint=OWN.joint(),
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
    params:
        captures=OWN.of("fitted"),
        minimised=OWN.of("minimised"),
        estimated=OWN.of("direct"),
        groups=OWN.groups,
        curves=OWN.of("curves"),
        errors=RUN.errors,
        origin=lambda wildcards: STANDING.origin(wildcards.object),
    message:
        "Summary of {wildcards.object}: every sensor, capture and method"
    script:
        "../scripts/stages/summary.py"


for figure in OWN_FIGURES:

    rule:
        name:
            f"own_{figure.name}"
        input:
            **figure.inputs(OWN),
        output:
            **figure.rule_outputs(OWN, report, CAPTION),
        log:
            RUN.results(f"logs/own_{figure.name}/{{object}}.log"),
        benchmark:
            RUN.results(f"benchmarks/own_{figure.name}/{{object}}.tsv")
        wildcard_constraints:
            object=one_of(OWN.names),
        params:
            **figure.rule_params(OWN),
        message:
            f"Figure of {{wildcards.object}}: {figure.title}"
        script:
            "../scripts/stages/artefact.py"


rule own_report:
    input:
        **{
            one.name: RUN.results(f"{{object}}/figures/{one.name}.png")
            for one in OWN_FIGURES
        },
        summary=RUN.results("{object}/summary.csv"),
        fits=OWN.files(OWN.captures, "hertz.json"),
        direct=OWN.files(OWN.captures, "direct.json"),
        joint=OWN.joint(),
        poses=OWN.files(OWN.captures, "probe_pose.csv"),
        folders=OWN.recorded(OWN.captures),
        object=RUN.raw("{object}/object.yaml"),
        solid=RUN.results("{object}/solid.vtu"),
        quality=RUN.results("{object}/solid_quality.json"),
        tables=OWN.tables,
        masks=OWN.masks,
        clouds=OWN.files(OWN.first, "clouds.npz"),
        recorded=OWN.recorded(OWN.first),
        optics=OWN.optics,
        tracked=OWN.files(OWN.first, f"tracked-{RUN.tracker}.npz"),
        fitted=OWN.joint("fitted.npz"),
        template=RUN.template_of,
        paths=OWN.files(OWN.first, "path.csv"),
        motions=OWN.files(OWN.first, "motion.npz"),
        alignments=OWN.files(OWN.first, "alignment.json"),
    output:
        page=RUN.results("{object}/report.html"),
    log:
        RUN.results("logs/own_report/{object}.log"),
    benchmark:
        RUN.results("benchmarks/own_report/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN.names),
    params:
        captures=OWN.captures,
        first=OWN.first,
        sensors=OWN.sensors,
        groups=OWN.groups,
        points=OWN.points,
        probe=RUN.probe_spec,
        options=RUN.config["direct"]["fit"],
        version=palpate.__version__,
    message:
        "Page of {wildcards.object}"
    script:
        "../scripts/stages/own_report.py"


rule own_data:
    input:
        fitted=OWN.joint("fitted.npz"),
        motions=OWN.files(OWN.of("direct"), "motion.npz"),
        curves=OWN.files(OWN.of("curves"), "curve.json"),
        summary=RUN.results("{object}/summary.csv"),
        budgets=OWN.joint("uncertainty_budget.csv"),
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
    params:
        captures=OWN.of("direct"),
        groups=OWN.groups,
        curves=OWN.of("curves"),
    message:
        "Data of {wildcards.object}, with what describes them"
    script:
        "../scripts/stages/own_data.py"


# Of many objects a part: --batch objects=1/10, see docs/developers.md.
rule objects:
    input:
        OWN.outputs(one.name for one in OWN_FIGURES),
    message:
        "All of people's own objects is made"
