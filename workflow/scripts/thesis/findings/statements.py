"""The study's findings as statements that its numbers and ours are held against."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import yaml
from palpate.units import PERCENT

from thesis.findings import checks, printed
from thesis.findings.checks import LAME
from thesis.findings.verdicts import LEVEL, UNTESTABLE, Outcome

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
