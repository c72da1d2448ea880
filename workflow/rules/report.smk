# Summary, configuration and pages: what a person reads of a run.
import palpate
from thesis.selections import objects_shown


report: "../report/workflow.rst"


rule summary:
    input:
        fits=RUN.files(RUN.described("fitted"), "hertz.json"),
        results=RUN.minima_of(RUN.described()),
        direct=RUN.files(RUN.described("direct"), "direct.json"),
        joint=RUN.joint_estimates(),
        curves=RUN.files(RUN.described("curves"), "curve.json"),
    output:
        csv=RUN.results("summary.csv"),
        page=report(
            RUN.results("pages/summary.html"),
            caption=CAPTION,
            category="This run",
            labels={"Result": "Summary: every capture and method"},
        ),
    log:
        RUN.results("logs/summary.log"),
    benchmark:
        RUN.results("benchmarks/summary.tsv")
    localrule: True
    conda:
        "../envs/palpate.yaml"
    params:
        title="Summary: every capture and method",
        caption="E, nu and E* with intervals and verdicts, all moduli in Pa. The same is in"
        " ``summary.csv``.\n\nRows whose provenance is *simulated* come from the virtual lab.",
        captures=RUN.described("fitted"),
        minimised=RUN.described("minimised"),
        estimated=RUN.described("direct"),
        groups=RUN.groups(),
        curves=RUN.described("curves"),
        errors=RUN.errors,
    message:
        "Summary: every object, sensor, capture and method"
    script:
        "../scripts/stages/summary.py"


rule configuration:
    input:
        lock=str(PROJECT / "environment.lock"),
    output:
        md=RUN.results("configuration.md"),
        page=report(
            RUN.results("pages/configuration.html"),
            caption=CAPTION,
            category="This run",
            labels={"Result": "Configuration and versions"},
        ),
        wanted=RUN.results("wanted.txt"),
    log:
        RUN.results("logs/configuration.log"),
    benchmark:
        RUN.results("benchmarks/configuration.tsv")
    localrule: True
    conda:
        "../envs/palpate.yaml"
    params:
        title="Configuration and versions",
        caption="Options of this run after all overrides, and the versions of project, Python and"
        " pinned packages.",
        config=RUN.config,
        version=palpate.__version__,
        wanted=[RUN.within_results(path) for path in WANTED],
    message:
        "Configuration and versions of the run, and what it makes"
    script:
        "../scripts/stages/configuration.py"


rule objects_page:
    input:
        page=str(PROJECT / "workflow/report/objects.html"),
        behaviour=str(PROJECT / "workflow/report/objects.js"),
        tracked=RUN.files(objects_shown(RUN), f"tracked-{RUN.tracker}.npz"),
        fits=RUN.files(objects_shown(RUN), "hertz.json"),
        minima=RUN.minima_of(objects_shown(RUN)),
    output:
        page=RUN.results("objects.html"),
    log:
        RUN.results("logs/objects_page.log"),
    benchmark:
        RUN.results("benchmarks/objects_page.tsv")
    conda:
        "../envs/palpate.yaml"
    params:
        captures=objects_shown(RUN),
        minimised=RUN.described("minimised"),
        errors=RUN.errors,
        tracker=RUN.tracker,
    message:
        "Tracked objects in three dimensions"
    script:
        "../scripts/stages/objects_page.py"
