"""The study's findings as statements that its numbers and ours are held against."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import pandas as pd

from thesis.findings import checks, printed, sensor_checks
from thesis.findings.checks import LAME
from thesis.findings.verdicts import LEVEL, UNTESTABLE, Outcome

COLUMNS = ["finding", "where", "rule", "published_evidence", "published_holds"]
COLUMNS += ["ours_evidence", "holds", "remark", "provenance"]
NOTHING = "words or curves only"
NOT_HERE = "no such captures in this run"
EITHER = f"uncorrected p below {LEVEL:g}, does not hold where that is so of the opposite"
SIGN = f"one-sided sign test, {EITHER}"
ONE_EACH = f"mean of both error options, one pair a capture; {SIGN}"
TREND = f"rank correlation above zero, one-sided {EITHER}, for every sensor"
NU_KNOWN = "minima that identify nu alone; "
NOISY = (
    "median of a Lame parameter off by more than 10 % by the linear method and by less than 10 %"
    " by minimisation, at every level of noise from 0.1 to 1 mm (the tracker errs by 0.3 to 0.7 mm)"
)
HOMOGENEOUS = "the lab's block is homogeneous by construction"


@dataclass(frozen=True)
class Finding:
    """A statement of the study and the computation that decides it.

    Attributes
    ----------
    finding, where, rule : str
        What it says, its section, and the rule of decision.
    needs : str
        Name of the table that the check takes.
    check : callable
    remark : str
        What a reader must know of simulated captures.
    excluded : str
        Why simulated captures cannot bear it out, whatever they give.
    """

    finding: str
    where: str
    rule: str
    needs: str
    check: Callable[[pd.DataFrame], Outcome]
    remark: str = ""
    excluded: str = ""


FINDINGS = (
    Finding("the linear method finds the moduli from exact data", "Section 3.3.2, Figure 3.5",
            "both Lame parameters within 0.1 %", "simulation", checks.exact_on_exact_data),
    Finding("it does so from any start", "Section 3.3.2, Figure 3.6",
            "parameters of all starts within 0.1 %", "starts", checks.whatever_the_start),
    Finding("it fails on tracked data", "Section 3.3.2, Figure 3.7",
            "a Lame parameter off by more than half", "simulation", checks.fails_on_tracked_data,
            "the tracked points of our simulated block are closer to its surface"),
    Finding("it does not tolerate noise, displacement error minimisation does",
            "Sections 3.4 and 6.1", NOISY, "noise", checks.DISPLACEMENT_BEARS_NOISE),
    Finding("it does not tolerate noise, combined error minimisation does",
            "Sections 3.4 and 6.1", NOISY, "noise", checks.BOTH_BEAR_NOISE),
    Finding("error minimisation comes close on tracked data, but not exactly", "Section 3.3.4",
            "both Lame parameters within 10 %, not both within 0.1 %", "simulation",
            checks.close_on_tracked_data,
            "printed lambda over mu is 9.000, that is nu of 0.45: the true one, and one of our"
            " starting values, so this shows a fit of the scale alone"),
    Finding("it comes closer than the linear method", "Sections 3.3.4 and 6.1",
            "its worse Lame parameter is less far off", "simulation",
            checks.minimisation_is_closer),
    Finding("a low reprojection threshold makes the resting tip scatter more", "Section 4.2.3,"
            " Figure 4.15", "z at the least threshold against the selected one; " + SIGN
            + ", for every sensor", "workspace", sensor_checks.low_threshold_scatters),
    Finding("the normal's angle scatters least at 0.25 px (Bumblebee) and 0.45 px (Kinect), more"
            " at higher thresholds", "Section 4.2.3, Figure 4.16",
            "deviation at the highest threshold against the printed one, point by point; " + SIGN
            + ", for every sensor", "workspace", sensor_checks.angle_least_inside),
    Finding("more corners are inliers the higher the threshold", "Section 4.2.3, Figure 4.17",
            TREND, "workspace", sensor_checks.MORE_INLIERS),
    Finding("the reprojection error grows with the threshold", "Section 4.2.3, Figure 4.18",
            TREND, "workspace", sensor_checks.MORE_REPROJECTION),
    Finding("the tip scatters most along the camera's axis", "Section 4.2.3, Table 4.2",
            "z above x and y for every sensor", "tip", sensor_checks.deepest_axis_worst),
    Finding("the tip scatters more the farther it is", "Section 4.2.3, Figure 4.19",
            "z against distance: " + TREND, "workspace", sensor_checks.grows_with_distance),
    Finding("the Bumblebee traces the CD case more precisely", "Section 4.2.4",
            "the offset of its path by the study's filter deviates less; not decided where the"
            f" deviations are within a factor of {sensor_checks.STEADIER:g}, as there is one trace"
            " each", "case", sensor_checks.steadier_tracing,
            "tracing by hand is part of it, and its hand is the same"),
    Finding("presses of one point repeat well", "Section 5.1, Table 5.1",
            "deviation of E* below 10 % of the mean", "repeats", checks.repeatable,
            "the lab's hand trembles, its material does not age"),
    Finding("the block is stiffer in the middle than at its border", "Section 5.1, Table 5.2",
            f"E* of points 5, 8, 11, 14 against the others: Mann-Whitney test, uncorrected p"
            f" below {LEVEL:g}, and medians apart by {checks.LEAST_PATTERN:g}, for every sensor;"
            " does not hold where the test excludes so much", "points",
            checks.stiffer_in_the_middle,
            excluded=HOMOGENEOUS + "; its edges make it 1 to 2 % softer at most"),
    Finding("the Kinect's surface is noisier than the Bumblebee's", "Section 5.2.1",
            "median distance of the clouds from the true surface: " + SIGN, "clouds",
            checks.noisier_clouds),
    Finding("the combined error gives lower E* than Hertz's model on the block", "Section 5.2.1,"
            " Table 5.3", SIGN, "estimates", checks.below_hertz),
    Finding("the displacement error's E* is closer to Hertz's on the block", "Sections 5.2.1 and"
            " 5.3", "logarithms of the ratios; " + SIGN, "estimates",
            checks.displacement_nearer_to_hertz),
    Finding("the Bumblebee's displacement error is closer to Hertz's than the Kinect's",
            "Section 6.1", "logarithms of the ratios; " + SIGN, "estimates",
            checks.kinect_farther_from_hertz),
    Finding("of points 8, 16 and 17 of the block 16 is the softest", "Section 5.2.1, Table 5.3",
            "least E of every sensor and error option", "estimates", checks.softest_at_point_16,
            excluded=HOMOGENEOUS),
    Finding("the displacement error gives larger E than the combined error",
            "Sections 5.2 and 6.1", SIGN, "estimates", checks.E_LARGER),
    Finding("the displacement error gives larger nu than the combined error",
            "Sections 5.2 and 5.3", NU_KNOWN + SIGN, "estimates", checks.NU_LARGER),
    Finding("the Kinect gives larger E than the Bumblebee", "Sections 5.2 and 6.1", ONE_EACH,
            "estimates", checks.KINECT_E_LARGER),
    Finding("the Kinect gives larger nu than the Bumblebee", "Section 6.1",
            NU_KNOWN + ONE_EACH, "estimates", checks.KINECT_NU_LARGER,
            "Section 6.1 says larger parameters; Section 5.2.2 says the ball's nu is the same"),
    Finding("the block is softer than the ear, the ear than the ball", "Section 5.2.3",
            "medians of E by the Bumblebee, for each error option", "estimates",
            checks.softest_to_stiffest, "the lab was given moduli in that order"),
    Finding("nu of the ball is above that of block and ear", "Section 5.3",
            NU_KNOWN + "medians by the Bumblebee, for each error option", "estimates",
            checks.BALL_KEEPS_ITS_VOLUME,
            "true nu of the lab: ball 0.40, block 0.30, ear 0.45"),
    Finding("tracked from one view the ball shrinks, from turned clouds less", "Section 5.2.2,"
            " Figure 5.13", f"loses {100 * sensor_checks.SHRUNK:g} % of its volume in the most"
            " pressed frame, and as much more than from turned clouds, for every sensor; does not"
            " hold where it loses less", "volumes", sensor_checks.one_view_shrinks,
            "one press by each sensor"),
    Finding("the ball's last error is larger than the block's", "Section 5.2.2",
            "combined error per vertex", "settled", checks.more_error_on_the_ball),
    Finding("the ear's minimisation settles in fewer iterations", "Section 5.2.3, Figure 5.17",
            "iteration from which lambda and mu stay within 1 %, against block and ball",
            "settled", checks.ear_settles_first),
    Finding("the ear's error hardly falls", "Section 5.2.3",
            "by less than a tenth, and by less than half as much as the block's and the ball's",
            "settled", checks.error_falls_little,
            "our trace starts from the best of nine starts, near its minimum on every object"),
)  # fmt: skip


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
    one: Finding, mine: Outcome, ours: Mapping[str, pd.DataFrame], provenance: str
) -> tuple[str, str]:
    """Verdict of ours, and what must be known of it."""
    simulated = provenance == "simulated" and mine.evidence != NOT_HERE
    verdict = UNTESTABLE if simulated and one.excluded else mine.verdict
    said = [one.excluded or one.remark] if simulated else []
    of_nu = one.rule.startswith(NU_KNOWN)
    if one.needs == "estimates" and mine.evidence != NOT_HERE and not of_nu:
        said.append(checks.identified_in_words(ours["estimates"]))
    return verdict, "; ".join(filter(None, said))


def _outcome(one: Finding, tables: Mapping[str, pd.DataFrame], otherwise: str) -> Outcome:
    table = tables.get(one.needs)
    if table is None or table.empty:
        return Outcome(otherwise, None)
    return one.check(table)
