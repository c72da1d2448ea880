"""Every printed number of the study beside ours, and its findings held against both."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import yaml
from palpate.json_fields import read_all, read_one
from palpate.report import outputs
from palpate.solid.mesh import read_solid
from palpate.units import PERCENT
from palpate.vision.pose import CORNERS, select_threshold

from thesis.chapter5.tracking_inputs import last_frames, surface_of
from thesis.findings import checks, comparison, printed
from thesis.findings.checks import LAME
from thesis.findings.verdicts import LEVEL, UNTESTABLE, Outcome

# Columns of names, which stay words.
NAMES = {"capture": str, "point": str, "attempt": str}
# Of the findings' tables, those that are a table of the run as it is.
SOURCES = {"points": "table_5_2", "tip": "table_4_2", "simulation": "simulation"}
SOURCES |= {"noise": "simulation_noise", "case": "cd_case"}
COLUMNS = ["finding", "where", "rule", "published_evidence", "published_holds"]
COLUMNS += ["ours_evidence", "holds", "remark", "provenance"]
NOTHING = "words or curves only"
NOT_HERE = "no such captures in this run"
EITHER = f"uncorrected p below {LEVEL:g}, does not hold where that is so of the opposite"
SIGN = f"one-sided sign test, {EITHER}"
# What findings.yaml names in braces.
WORDS = {
    "sign": SIGN,
    "one_each": f"mean of both error options, one pair a capture; {SIGN}",
    "trend": f"rank correlation above zero, one-sided {EITHER}, for every sensor",
    "nu_known": "minima that identify nu alone; ",
    "homogeneous": "the lab's block is homogeneous by construction",
    "level": LEVEL,
    "least_pattern": checks.LEAST_PATTERN,
    "steadier": checks.STEADIER,
    "shrunk": PERCENT * checks.SHRUNK,
}
NOT_SAID = {"remark": "", "excluded": ""}
TABLE = Path(__file__).with_name("findings.yaml")
_ENTRIES = yaml.load(TABLE.read_text(encoding="utf-8"), yaml.CSafeLoader)
FINDINGS = tuple(
    SimpleNamespace(**NOT_SAID | {name: text.format(**WORDS) for name, text in one.items()})
    for one in _ENTRIES
)
FINDINGS_NOTES = (
    "p values are one-sided, and not corrected for the number of findings, which are"
    f" {len(FINDINGS)}: about one test in twenty would come out by chance alone.",
    "Columns published_evidence and published_holds apply the same rule to the printed numbers.",
)


def make_comparison(inputs: Any, params: Any) -> pd.DataFrame:
    """The comparison, one row a printed number."""
    linear = read_one(inputs.linear)
    counts = [len(read_solid(path).nodes_m) for path in inputs.solids]
    ours = comparison.our_numbers(
        tables_of(inputs.tables),
        traces=traces_of(inputs, params.captures, params.error),
        nodes=list(zip(params.solids, counts, strict=True)),
        residual_n=linear["estimates"][0]["residual_n"] if linear else None,
    )
    numbers = printed.published_numbers(tables_of(inputs.published))
    return comparison.comparison(numbers, ours, truths(inputs, params))


def truths(inputs: Any, params: Any) -> dict[tuple[str, str], float]:
    """What the lab was given, by object or sensor and by quantity."""
    found = {}
    for name, material in zip(params.materials, read_all(inputs.materials), strict=True):
        for quantity in printed.MODULI:
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
    printed_tables = tables_of(inputs.published)
    if ours["workspace"] is not None:
        thresholds = printed_thresholds(printed_tables["text"])
        ours["workspace"]["published_px"] = ours["workspace"]["sensor"].map(thresholds)
    numbers = published_tables(printed_tables)
    table = findings(numbers, ours, provenance=provenance)
    short = table[["finding", "published_holds", "holds"]]
    short.columns = ["Finding of the study", "by its printed numbers", "by ours"]
    long = outputs.table(table, more_notes=FINDINGS_NOTES, **params.table)
    return long | {"overview": short}


def our_tables(inputs: Any, params: Any) -> dict[str, pd.DataFrame | None]:
    """Our tables by the names that the findings need."""
    known = tables_of(inputs.tables)
    ours = {"estimates": comparison.estimates(known["summary"])}
    ours |= {name: known.get(source) for name, source in SOURCES.items()}
    if "table_5_1" in known:
        attempts = known["table_5_1"]["attempt"].str.isdigit()
        ours["repeats"] = known["table_5_1"][attempts]
    if "pipeline_accuracy" in known:
        rows = known["pipeline_accuracy"].rename(columns={"capture": "point"})
        ours["clouds"] = rows[rows["quantity"] == "cloud_median"]
    linear = read_one(inputs.linear)
    ours["starts"] = pd.DataFrame(linear["estimates"]) if linear else None
    ours["settled"] = comparison.settled(traces_of(inputs, params.captures, params.error))
    ours["workspace"] = workspaces_of(params.workspaces, inputs.workspaces)
    ours["volumes"] = volumes_of(inputs, params.balls)
    return ours


def tables_of(paths: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Tables by the names of their files; names of points stay words."""
    return {Path(path).stem: pd.read_csv(path, dtype=NAMES) for path in paths}


def traces_of(inputs: object, captures: Sequence[Mapping], error: str) -> list[tuple]:
    """Capture, error option and trace of each minimisation."""
    minima = read_all(inputs.minima)
    pairs = zip(captures, minima, strict=True)
    return [(capture, error, minimum["trace"]) for capture, minimum in pairs]


def workspaces_of(sensors: Sequence[str], paths: Sequence[str]) -> pd.DataFrame | None:
    """Workspace by each sensor as the study reads it, the selected threshold marked."""
    parts = []
    for sensor, path in zip(sensors, paths, strict=True):
        table = pd.read_csv(path)
        mine = table[table["method"] == CORNERS].assign(sensor=sensor)
        parts.append(mine.assign(selected=mine["threshold_px"] == select_threshold(table)))
    return pd.concat(parts, ignore_index=True) if parts else None


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


def findings(
    published: Mapping[str, pd.DataFrame], ours: Mapping[str, pd.DataFrame], *, provenance: str
) -> pd.DataFrame:
    """Hold every finding against the printed numbers and ours.

    Parameters
    ----------
    published, ours : mapping
        Tables by the names that `FINDINGS` need; one that is missing leaves a finding open.
    provenance : str
        Of our captures.

    Returns
    -------
    DataFrame
        One row for each finding: evidence in words, and ``holds``, ``does not hold`` or ``not
        decided`` of the printed numbers (``published_holds``) and ours (``holds``); ours are ``not
        testable here`` where the lab's objects exclude the finding.
    """
    rows = []
    for one in FINDINGS:
        theirs, mine = _outcome(one, published, NOTHING), _outcome(one, ours, NOT_HERE)
        values = [one.finding, one.where, one.rule, theirs.evidence, theirs.verdict]
        values += [mine.evidence, *_ours(one, mine, ours, provenance), provenance]
        rows.append(dict(zip(COLUMNS, values, strict=True)))
    return pd.DataFrame(rows)


def published_tables(published: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Tables of the findings from config/published/*.csv, by name; curves cannot be read."""
    simulation = published["simulation"].copy()
    exact = simulation[simulation["data"] == "exact"].iloc[0]
    for name in LAME:
        simulation[f"true_{name}"] = exact[name]
    return {
        "estimates": printed.estimates(published),
        "points": published["table_5_2"],
        "repeats": published["table_5_1"],
        "simulation": simulation,
        "tip": printed.tip_of(published["table_4_2"]),
        "settled": _printed_traces(published["text"]),
    }


def printed_thresholds(text: pd.DataFrame) -> dict[str, float]:
    """Reprojection threshold that Figure 4.16 prints for each sensor [px]."""
    mine = text[text["quantity"] == "selected_threshold"]
    return dict(zip(mine["sensor"], mine["published"], strict=True))


def _printed_traces(text: pd.DataFrame) -> pd.DataFrame:
    """Iterations and errors that the text prints, one row for each object."""
    wide = text.pivot_table(index="object", columns="quantity", values="published")
    names = {"error_first": "error_first_mm", "error_last": "error_last_mm"}
    columns = ["settled_iteration", *names.values()]
    table = wide.rename(columns=names)[columns].dropna(how="all")
    return table.reset_index()


def _ours(
    one: SimpleNamespace, mine: Outcome, ours: Mapping[str, pd.DataFrame], provenance: str
) -> tuple[str, str]:
    """Verdict of ours, and what must be known of it."""
    simulated = provenance == "simulated" and mine.evidence != NOT_HERE
    verdict = UNTESTABLE if simulated and one.excluded else mine.verdict
    said = [one.excluded or one.remark] if simulated else []
    of_nu = one.check.startswith(checks.where_identified.__name__)
    if one.needs == "estimates" and mine.evidence != NOT_HERE and not of_nu:
        said.append(checks.identified_in_words(ours["estimates"]))
    return verdict, "; ".join(filter(None, said))


def _outcome(one: SimpleNamespace, tables: Mapping[str, pd.DataFrame], otherwise: str) -> Outcome:
    table = tables.get(one.needs)
    if table is None or table.empty:
        return Outcome(otherwise, None)
    return checks.check_of(one.check)(table)
