# What a person gets of an object of their own: a summary, figures, and a page of them.
rule own_summary:
    input:
        fits=each(captures_of, "hertz.json"),
        results=each(captures_of, *(f"minimise-{error}.json" for error in ERRORS)),
        direct=each(captures_of, "direct.json"),
        joint=together_of,
    output:
        csv=results("{object}/summary.csv"),
    log:
        results("logs/own_summary/{object}.log"),
    benchmark:
        results("benchmarks/own_summary/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN_OBJECTS),
    params:
        code=code("summary"),
        captures=captures_of,
        tracked=captures_of,
        estimated=captures_of,
        groups=groups_of,
        errors=ERRORS,
    message:
        "Summary of {wildcards.object}: every sensor, capture and method"
    script:
        "../scripts/summary.py"


rule own_moduli:
    input:
        direct=each(captures_of, "direct.json"),
        joint=together_of,
        materials=[],
    output:
        png=captioned(results("{object}/figures/moduli.png")),
        svg=results("{object}/figures/moduli.svg"),
    log:
        results("logs/own_moduli/{object}.log"),
    benchmark:
        results("benchmarks/own_moduli/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN_OBJECTS),
    params:
        code=code("direct_moduli"),
        captures=captures_of,
        groups=groups_of,
    message:
        "Figure of E and nu of {wildcards.object}"
    script:
        "../scripts/direct_moduli.py"


rule own_hertz_fit:
    input:
        fits=each(fitted_of, "hertz.json"),
    output:
        png=captioned(results("{object}/figures/hertz_fit.png")),
        svg=results("{object}/figures/hertz_fit.svg"),
    log:
        results("logs/own_hertz_fit/{object}.log"),
    benchmark:
        results("benchmarks/own_hertz_fit/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN_OBJECTS),
    params:
        code=code("figure_5_2"),
        captures=fitted_of,
    message:
        "Figure of the Hertz fit of {wildcards.object}"
    script:
        "../scripts/figure_5_2.py"


rule own_surface:
    input:
        tracked=each(first_of, f"tracked-{TRACKER}.npz"),
        clouds=each(first_of, "clouds.npz"),
        fits=each(first_of, "hertz.json"),
        recorded=recorded_of,
    output:
        png=captioned(results("{object}/figures/surface.png")),
        svg=results("{object}/figures/surface.svg"),
    log:
        results("logs/own_surface/{object}.log"),
    benchmark:
        results("benchmarks/own_surface/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN_OBJECTS),
    params:
        code=code("tracked_surface"),
        captures=first_of,
        sensors=sensors_of_first,
    message:
        "Figure of the tracked surface of {wildcards.object}"
    script:
        "../scripts/tracked_surface.py"


rule own_report:
    input:
        summary=results("{object}/summary.csv"),
        fits=each(captures_of, "hertz.json"),
        direct=each(captures_of, "direct.json"),
        moduli=results("{object}/figures/moduli.png"),
        hertz_fit=results("{object}/figures/hertz_fit.png"),
        surface=results("{object}/figures/surface.png"),
    output:
        page=results("{object}/report.html"),
    log:
        results("logs/own_report/{object}.log"),
    benchmark:
        results("benchmarks/own_report/{object}.tsv")
    wildcard_constraints:
        object=one_of(OWN_OBJECTS),
    params:
        code=code("own_report"),
        captures=captures_of,
    message:
        "Page of {wildcards.object}"
    script:
        "../scripts/own_report.py"
