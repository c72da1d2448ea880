"""Where an object's tables are, and how its material comes into other programmes."""

from collections.abc import Sequence

from palpate.report.data_package import TITLES
from palpate.report.material_cards import PROGRAMMES

SUMMARY, BUDGET, PACKAGE = "summary.csv", "uncertainty_budget.csv", "datapackage.json"
DESCRIBED = "What each of their columns is, and its unit (a Frictionless Data Package)"
EXPORTED = (
    "The recommended estimate as the material of a programme of finite elements, intervals and"
    " doubts in its comment; from a shell in the project's folder, with {others} as well:"
)


def data(name: str, estimates: Sequence[str], sensors: Sequence[str]) -> str:
    """Links from an object's page to its tables, and what exports its material.

    Parameters
    ----------
    name : str
        The object, as its folder is called.
    estimates : sequence of str
        What its recommended estimates are called; see `material.names_of`.
    sensors : sequence of str
        Those with a budget.

    Returns
    -------
    str
        Markdown. The tables are not read: a run makes them beside the page.
    """
    tables = {place: told for place, told in TITLES.items() if place.startswith("data/")}
    tables |= {SUMMARY: TITLES[SUMMARY]}
    tables |= {f"{sensor}/{BUDGET}": TITLES[BUDGET] for sensor in sensors}
    tables |= {PACKAGE: DESCRIBED}
    links = [f"- [{place}](<{place}>): {told}." for place, told in tables.items()]
    which = [f" --sensor {one}" for one in estimates] if len(estimates) > 1 else [""]
    first, *others = PROGRAMMES
    commands = [f"palpate export {name}{one} --to {first}" for one in which]
    told = EXPORTED.format(others=" or ".join(others))
    return "\n".join([*links, "", told, "", "```", *commands, "```"])
