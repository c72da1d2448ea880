# Pages: tables for the report, the run's configuration, the tracked objects in three dimensions.
report: "../report/workflow.rst"


rule table_pages:
    input:
        md=[results(f"tables/{name}.md") for name in tables_among(tables_and_figures())],
        configuration=results("configuration.md"),
        summary=results("summary.csv"),
    output:
        tables=captioned(
            [
                results(f"pages/{name}.html")
                for name in tables_among(tables_and_figures())
            ]
        ),
        configuration=captioned(results("pages/configuration.html")),
        summary=captioned(results("pages/summary.html")),
    log:
        results("logs/table_pages.log"),
    benchmark:
        results("benchmarks/table_pages.tsv")
    params:
        code=code("table_pages"),
    message:
        "Tables as pages of the report"
    script:
        "../scripts/table_pages.py"


rule configuration:
    input:
        lock="environment.lock",
        project="pyproject.toml",
    output:
        md=results("configuration.md"),
        wanted=results("wanted.txt"),
    log:
        results("logs/configuration.log"),
    benchmark:
        results("benchmarks/configuration.tsv")
    params:
        code=code("configuration"),
        config=config,
        wanted=[str(Path(path).relative_to(RESULTS)) for path in study_outputs()],
    message:
        "Configuration and versions of the run, and what it makes"
    script:
        "../scripts/configuration.py"


rule objects_page:
    input:
        page="workflow/report/objects.html",
        behaviour="workflow/report/objects.js",
        tracked=files_of(objects_shown(), f"tracked-{TRACKER}.npz"),
        fits=files_of(objects_shown(), "hertz.json"),
        minima=[
            path
            for capture in objects_shown()
            for error in ERRORS
            for path in files_of([capture], f"minimise-{error}.json")
        ],
    output:
        page=results("objects.html"),
    log:
        results("logs/objects_page.log"),
    benchmark:
        results("benchmarks/objects_page.tsv")
    params:
        code=code("objects_page"),
        captures=objects_shown(),
        errors=ERRORS,
        tracker=TRACKER,
    message:
        "Tracked objects in three dimensions"
    script:
        "../scripts/objects_page.py"
