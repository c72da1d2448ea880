# Summary, configuration and pages: what a person reads of a run.
import palpate
from thesis.selections import Selection


report: "../report/workflow.rst"


# Surfaces of objects with a page of their own are on that.
PAGED = [*OWN.paged, *STANDING.paged]
OF_RUN, BEFORE = (
    [capture for capture in shown if capture["object"] not in PAGED]
    for shown in (Selection(RUN).objects_shown(), STANDING.tracked())
)
SHOWN = [*OF_RUN, *BEFORE]
MINIMISED_BEFORE = RUN.with_minima(BEFORE)


rule summary:
    input:
        summaries=OWN.summaries(STANDING.names),
    output:
        csv=RUN.results("summary.csv"),
        overview=RUN.results("pages/overview.csv"),
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
    params:
        pages=PAGED,
        title="Summary: every capture and method",
        caption="E, nu and E* with intervals and verdicts, all moduli in Pa. The same is in"
        " ``summary.csv``.\n\nRows whose provenance is *simulated* come from the virtual lab.",
    message:
        STANDING.told("Summary: every object, sensor, capture and method")
    script:
        "../scripts/stages/objects_summary.py"


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
    log:
        RUN.results("logs/configuration.log"),
    benchmark:
        RUN.results("benchmarks/configuration.tsv")
    localrule: True
    params:
        title="Configuration and versions",
        caption="Options of this run after all overrides, and the versions of project, Python and"
        " pinned packages.",
        config=RUN.config,
        version=palpate.__version__,
    message:
        "Configuration and versions of the run"
    script:
        "../scripts/stages/configuration.py"


rule objects_page:
    input:
        tracked=RUN.files(SHOWN, f"tracked-{RUN.tracker}.npz"),
        fits=RUN.files(SHOWN, "hertz.json"),
        summary=RUN.results("summary.csv"),
        minima=RUN.minima_of(OF_RUN) + RUN.files(MINIMISED_BEFORE, *RUN.minima),
    output:
        page=RUN.results("objects.html"),
    log:
        RUN.results("logs/objects_page.log"),
    benchmark:
        RUN.results("benchmarks/objects_page.tsv")
    params:
        captures=SHOWN,
        minimised=[*RUN.described("minimised"), *MINIMISED_BEFORE],
        errors=RUN.errors,
        tracker=RUN.tracker,
        pages=PAGED,
    message:
        "Tracked objects in three dimensions"
    script:
        "../scripts/stages/objects_page.py"
