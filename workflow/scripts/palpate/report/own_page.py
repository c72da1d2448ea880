"""Page of one object: how stiff it is, how well that is known, and from what."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

import pandas as pd

from palpate.capture.discover import CURVE
from palpate.modulus import VERDICTS, Modulus, verdicts_in
from palpate.report import budget_bars
from palpate.report import own_words as words
from palpate.report.data_package import data
from palpate.report.held import FRAMES_NOTE, Held, checks_of, press_of, recording, rows
from palpate.report.material import names_of
from palpate.report.other_methods import HERTZ, others
from palpate.report.press_pictures import Glimpse
from palpate.report.style import sensor_name
from palpate.report.table_page import document, figure, rendered, table
from palpate.report.turning_view import section

BRACKETS = (
    "In brackets: 95 % intervals. E* is E/(1 - nu^2), what a contact feels; the effective one is"
    " that of the neo-Hookean solid with the same force at that depth after a second: above what is"
    " then left of E* where the object stiffens more than such a solid, below where it stiffens"
    " less."
)
SIMULATED_NOTE = "Simulated: pictures and forces were computed; no such object was pressed."
# What is told of each modulus, in the order in which they are told.
MODULI = {
    "effective_reduced_modulus_pa": (
        "effective E*",
        "of the neo-Hookean solid with the same force at the depth below, after a second: compare"
        " objects by it",
    ),
    "youngs_modulus_pa": ("E at once", "at small strain, right after the touch: to compute with"),
    "youngs_modulus_1s_pa": ("E after 1 s", "what is left of it after a second"),
    "poisson_ratio": ("nu", "0: sides stay; 0.5: volume stays"),
    "reduced_modulus_pa": ("E*", "E/(1 - nu^2), at small strain: what a contact feels"),
}
HOLD = (
    "Intervals of what is known, or known within limits, hold the true value in 95 of 100 cases;"
    " where nu is assumed, if it is right."
)
CAPTIONS = {
    "moduli": "How stiff the object is: lines are 95 % intervals, diamonds all captures with a"
    " sensor together. Intervals that overlap agree; a hollow symbol's value is not known: trust"
    " its interval.",
    "fit": "Left: force against how deep the tip is in the object, seen and computed with the"
    " recommended moduli. Right: how far the surface beside it moves along its normal, at the"
    " deepest. Below: residuals, most of which should be in the grey band, where 95 % of them are"
    " expected.",
    "known": "Left: which pairs of E and nu explain how deep the tip sinks under the force, how the"
    " surface moves, and both: regions of 95 % for both jointly, which reach further than the 95 %"
    " interval of either alone, but without the errors of rig and mesh that are in those above."
    " Middle: how likely each law of the force is. Right: how E falls in a press that is held, with"
    " 95 % intervals; dashed and hollow later than what was recorded.",
    "surface": "Deepest frame: the camera's picture, the surface that follows it, and a cut through"
    " the dent. Away from the probe, line and points should lie on each other.",
}


def own_page(
    name: str,
    summary: pd.DataFrame,
    held: Sequence[Held],
    *,
    pictures: Mapping[str, bytes],
    glimpses: Sequence[Glimpse],
    joints: Mapping[str, Mapping],
    settings: str,
    files: str,
    style: str,
    views: Mapping[str, Mapping] = MappingProxyType({}),
    behaviour: str = "",
    overview: str = "",
) -> str:
    """Write an object's page.

    Parameters
    ----------
    name : str
        The object.
    summary : DataFrame
        Its summary.csv.
    held : sequence of Held
        Its captures.
    pictures : mapping
        PNG by name, in their order; names as in `CAPTIONS`, and `HERTZ`.
    glimpses : sequence of Glimpse
        Frames as the camera saw them; the first is the deepest of a capture.
    joints : mapping
        direct.json of all captures together, by sensor.
    settings : str
        What the estimates were made with, in Markdown.
    files : str
        Files and options whole, in Markdown.
    style : str
        CSS beside that of all pages.
    views : mapping, optional
        Of `turning_view.view_of`, by the capture's name.
    behaviour : str, optional
        Script that makes them turn.
    overview : str, optional
        Where the page of all objects is, from here.

    Returns
    -------
    str
        HTML, all pictures within it.

    Raises
    ------
    ValueError
        If the summary recommends nothing.
    """
    advised = summary[summary["recommended"]].to_dict("records")
    if not advised:
        raise ValueError("recommended: expected a row for each sensor, found none")
    title = name.replace("_", " ").capitalize()
    checked = [(one.capture, checks_of(one)) for one in held]
    simulated = bool((summary["provenance"] == "simulated").any())
    back = f'<p class="screen"><a href="{overview}">All objects beside one another</a></p>'
    parts = [
        *[back] * bool(overview),
        *_first_screen(title, advised, joints, held, checked, glimpses[:1], simulated=simulated),
        *_how_stiff(advised, summary, joints, held),
        "<section><h2>What limits it</h2>",
        *(
            f"<h3>{sensor_name(sensor)}</h3>\n{budget_bars.bars(found['budget'])}"
            for sensor, found in joints.items()
        ),
        "</section>",
        "<section><h2>What was seen</h2>",
        *(section(capture, view) for capture, view in views.items()),
        *(figure(pictures[one], "image/png", CAPTIONS[one]) for one in pictures if one != HERTZ),
        "</section>",
        *_recording(held, checked, glimpses),
        *others(summary, pictures),
        '<section class="screen"><h2>Data</h2>',
        rendered(data(name, names_of(summary[summary["recommended"]]), list(joints))),
        "</section>",
        '<section class="settings"><h2>Settings, versions, checksums</h2>',
        rendered(settings),
        "<details><summary>Files and options, whole</summary>",
        rendered(files),
        "</details></section>",
    ]
    return document("\n".join(parts) + "\n", title=title, style=style, behaviour=behaviour)


def _first_screen(title, advised, joints, held, checked, glimpses, *, simulated) -> Iterator[str]:
    """What a reader with no time reads."""
    lines = [f"# {title}", ""]
    if simulated:
        lines += [f"*{SIMULATED_NOTE}*", ""]
    for one in advised:
        # A curve beside captures takes Poisson's ratio for granted.
        beside = one["sensor"] == CURVE and bool(checked)
        lines += [words.headline(one, "For comparison" if beside else title), ""]
        told, limits = list(words.verdict(one)), []
        if one["method"] == "direct_joint":
            told.append(words.range_of(_with(one, held)))
            limits = [budget_bars.largest(joints[one["sensor"]]["budget"]), ""]
        lines += [" ".join(told), "", *limits]
    lines += [BRACKETS, "", recording(checked), ""]
    lines += [
        f"- {sensor_name(one['sensor'])}: {doubt}."
        for one in advised
        if not pd.isna(one.get("doubts"))
        for doubt in one["doubts"].split("; ")
    ]
    yield '<section class="first"><div>'
    yield rendered("\n".join(lines))
    yield "</div>"
    for one in glimpses:
        yield figure(one.jpeg, "image/jpeg", f"{one.caption}: {one.shows}.")
    yield "</section>"


def _with(one: Mapping, held: Sequence[Held]) -> list[Held]:
    """Captures of a row's sensor."""
    return [each for each in held if each.capture["sensor"] == one["sensor"]]


def _how_stiff(advised, summary, joints, held) -> Iterator[str]:
    """Recommended moduli with intervals, and what follows from them."""
    yield '<section class="moduli"><h2>How stiff</h2>'
    for one in advised:
        mine = _with(one, held)
        ends_s = words.compared_s(mine)
        moduli = {key: (Modulus.of_row(one, key), *told) for key, told in MODULI.items()}
        lines = []
        if one["method"] == "direct_joint":
            direct = joints[one["sensor"]]
            moduli |= {key: (Modulus(**direct[key]), *told) for key, told in words.FURTHER.items()}
            lines = ["", words.conditions(direct, mine)]
        found = [words.cells(key, *of, ends_s) for key, of in moduli.items()]
        yield f"<h3>{words.by(one)}</h3>"
        yield rendered("\n".join([*table([row for row in found if row]), *lines]))
    given = {found[name]["verdict"] for found in joints.values() for name in words.FURTHER}
    given |= set(verdicts_in(summary[summary["recommended"]]))
    meanings = [
        f"- *{words.WORDS[one]}* ({one} in the tables): {told}."
        for one, told in VERDICTS.items()
        if one in given
    ]
    yield rendered("\n".join([HOLD, *meanings]))
    yield "</section>"


def _recording(held, checked, glimpses) -> Iterator[str]:
    """Whether the camera saw the right thing."""
    yield "<section><h2>Was the recording all right?</h2>"
    yield '<div class="checks">'
    yield rendered("\n".join(table(rows(checked))))
    yield "</div>"
    kinds = dict.fromkeys(one.shows for one in glimpses)
    yield rendered("\n".join(f"- {kind[0].upper()}{kind[1:]}." for kind in kinds))
    yield '<div class="glimpses">'
    yield from (figure(one.jpeg, "image/jpeg", one.caption) for one in glimpses)
    yield "</div>"
    yield rendered("\n".join([*table([press_of(one) for one in held]), "", FRAMES_NOTE]))
    yield "</section>"
