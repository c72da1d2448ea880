"""Every printed number of the study beside ours, and its findings held against both."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from palpate.json_fields import read_all, read_one
from palpate.report import outputs
from palpate.solid.mesh import read_solid

from thesis.chapter5.tracking_inputs import last_frames, surface_of
from thesis.findings import comparison, printed
from thesis.findings import statements as findings
from thesis.findings.comparison_inputs import settled_of, tables_of, traces_of, workspaces_of

COMPARISON = "Every printed number of the study beside ours"
COMPARISON_NOTES = (
    "published is the study's printed value, ratio is ours over it. What the study prints"
    " without naming a sensor or point stands beside each of ours. true is what the virtual lab"
    " was given; instantaneous moduli.",
    "Ours of selected_threshold comes of the rule of selection: deviations fall with the threshold"
    " and flatten without a clear minimum, and the smallest within 2 % of the least is taken.",
)
FINDINGS = "Findings of the study, held against its printed numbers and ours"
FINDINGS_NOTES = (
    "p values are one-sided, and not corrected for the number of findings, which are"
    f" {len(findings.FINDINGS)}: about one test in twenty would come out by chance alone.",
    "Columns published_evidence and published_holds apply the same rule to the printed numbers.",
)


def make_comparison(inputs: Any, params: Any) -> dict:
    """The comparison, one row a printed number."""
    linear = read_one(inputs.linear)
    ours = comparison.our_numbers(
        tables_of(inputs.tables),
        traces=traces_of(inputs, params.captures, params.error),
        nodes=list(zip(params.solids, map(nodes_of, inputs.solids), strict=True)),
        residual_n=linear["estimates"][0]["residual_n"] if linear else None,
    )
    numbers = printed.numbers(tables_of(inputs.published))
    table = comparison.comparison(numbers, ours, truths(inputs, params))
    return outputs.table(table, title=COMPARISON, more_notes=COMPARISON_NOTES)


def nodes_of(path: str) -> int:
    """Nodes of a solid."""
    return len(read_solid(path).nodes_m)


def truths(inputs: Any, params: Any) -> dict[tuple[str, str], float]:
    """What the lab was given, by object or sensor and by quantity."""
    found = {}
    for name, material in zip(params.materials, read_all(inputs.materials), strict=True):
        for quantity in printed.MODULI_UNITS:
            if quantity in material:
                found[name, quantity.removesuffix("_pa")] = material[quantity]
    simulated = read_one(inputs.simulated)
    if simulated:
        found[printed.SIMULATED, "lame_lambda"] = simulated["lambda_pa"]
        found[printed.SIMULATED, "lame_mu"] = simulated["mu_pa"]
    return found | optics(params.calibrated)


def optics(sensors: Mapping[str, Mapping]) -> dict[tuple[str, str], float]:
    """True optics of the sensors that the lab calibrates."""
    found = {}
    for name, sensor in sensors.items():
        for stream, block in (("color", "color"), ("infrared", "depth")):
            for quantity in printed.OPTICS:
                found[name, f"{stream}_{quantity[:2]}"] = sensor[block][quantity]
        matrix = np.array(sensor["depth"]["color_from_depth"], dtype=float)
        for i, j in np.ndindex(3, 4):
            found[name, f"r{i + 1}{j + 1}" if j < 3 else f"t{i + 1}"] = float(matrix[i, j])
    return found


def make_findings(inputs: Any, params: Any) -> dict:
    """The findings, one row each."""
    ours = our_tables(inputs, params)
    provenance = "/".join(sorted(set(ours["estimates"]["provenance"])))
    published = tables_of(inputs.published)
    if ours["workspace"] is not None:
        thresholds = findings.printed_thresholds(published["text"])
        ours["workspace"]["published_px"] = ours["workspace"]["sensor"].map(thresholds)
    numbers = findings.published_tables(published)
    table = findings.findings(numbers, ours, provenance=provenance)
    return outputs.table(table, title=FINDINGS, more_notes=FINDINGS_NOTES)


def our_tables(inputs: Any, params: Any) -> dict[str, pd.DataFrame | None]:
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


def volumes_of(inputs: Any, captures: Sequence[Mapping]) -> pd.DataFrame:
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
