"""The study's findings, held against its printed numbers and ours."""

import pandas as pd
from comparison_inputs import settled_of, tables_of, traces_of, workspaces_of
from job import run
from palpate.capture.files import whole_file
from palpate.study import comparison, findings, tables
from study_inputs import read_one
from tracking_inputs import last_frames, surface_of

TITLE = "Findings of the study, held against its printed numbers and ours"
NOTES = (
    "p values are one-sided, and not corrected for the number of findings, which are"
    f" {len(findings.FINDINGS)}: about one test in twenty would come out by chance alone.",
    "Columns published_evidence and published_holds apply the same rule to the printed numbers.",
)


def main(snakemake):
    """Write the findings as CSV and Markdown."""
    inputs, params, output = snakemake.input, snakemake.params, snakemake.output
    ours = our_tables(inputs, params)
    provenance = "/".join(sorted(set(ours["estimates"]["provenance"])))
    published = tables_of(inputs.published)
    if ours["workspace"] is not None:
        thresholds = findings.printed_thresholds(published["text"])
        ours["workspace"]["published_px"] = ours["workspace"]["sensor"].map(thresholds)
    printed = findings.published_tables(published)
    table = findings.findings(printed, ours, provenance=provenance)
    with whole_file(output.csv) as csv, whole_file(output.md) as md:
        tables.write(table, csv, md, title=TITLE, more_notes=NOTES)


def our_tables(inputs, params):
    """Our tables by the names that the findings need."""
    known = tables_of(inputs.tables)
    ours = {"estimates": comparison.estimates(known["summary"])}
    for name, source in (
        ("points", "table_5_2"),
        ("tip", "table_4_2"),
        ("simulation", "simulation"),
        ("noise", "simulation_noise"),
        ("case", "cd_case"),
    ):
        ours[name] = known.get(source)
    if "table_5_1" in known:
        attempts = known["table_5_1"]["attempt"].str.isdigit()
        ours["repeats"] = known["table_5_1"][attempts]
    if "pipeline_accuracy" in known:
        rows = known["pipeline_accuracy"].rename(columns={"capture": "point"})
        ours["clouds"] = rows[rows["quantity"] == "cloud_median"]
    linear = read_one(inputs.linear)
    ours["starts"] = pd.DataFrame(linear["estimates"]) if linear else None
    ours["settled"] = settled_of(traces_of(inputs, params.captures, params.error))
    ours["workspace"] = workspaces_of(params.workspaces, inputs.workspaces)
    ours["volumes"] = volumes_of(inputs, params.balls)
    return ours


def volumes_of(inputs, captures):
    """Change of the ball's volume as tracked from one view and from turned clouds, by sensor."""
    files = zip(captures, inputs.single_view, inputs.turned, last_frames(inputs), strict=True)
    return pd.DataFrame(
        {
            "sensor": capture["sensor"],
            "one_view_change": surface_of(one, frame).volume_change(),
            "turned_change": surface_of(turned, frame).volume_change(),
        }
        for capture, one, turned, frame in files
    )


run(main, snakemake)
