"""The table of artefacts: `artefacts.yaml`, one entry each, and the rule that follows from it."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from palpate.workflow.run import Described

from thesis.run import StudyRun
from thesis.selections import Selection

TABLE = Path(__file__).with_name("artefacts.yaml")
# Browsers sort results by name, letter for letter.
HAIR_SPACE = "\u200a"
CHAPTERS = {
    "1": "1 The system",
    "3": "3 Models and simulation",
    "4": "4 Seeing",
    "5": "5 Experiments",
    "a": "A Appendix",
    "comparison": "Beside the study",
    "accuracy": "Accuracy of the simulated captures",
}
BEYOND = "Beyond the study"
FORMS = {
    "figure": {"png": "figures/{}.png", "svg": "figures/{}.svg"},
    "table": {"csv": "tables/{}.csv", "md": "tables/{}.md", "page": "pages/{}.html"},
}
# Of files of artefacts that several rules share.
WILDCARDS = {"data": "exact|tracked"}
# What asks whether there are recordings about the sensors.
OF_SENSORS = ("calibrated", "experiments", "compared_experiments")


@dataclass(frozen=True)
class Artefact:
    """One rule of the thesis; `artefacts.yaml` says what the fields are.

    Attributes
    ----------
    name : str
        Of the rule.
    """

    name: str
    title: str
    make: str
    caption: str = ""
    message: str = ""
    shows: str = ""
    files: Mapping[str, str] = field(default_factory=dict)
    captures: str = ""
    inputs: Mapping[str, Any] = field(default_factory=dict)
    params: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, Any] = field(default_factory=dict)
    made: str = ""
    chapter: str = ""
    priority: int = 0
    local: bool = False

    @property
    def wanted(self) -> bool:
        """Whether a run makes it for its own sake; else where others need it."""
        return bool(self.shows)

    @property
    def of_sensors(self) -> bool:
        """Whether it is made from recordings about the sensors, which are of nobody's object."""
        return self.made.startswith(OF_SENSORS)

    @property
    def outputs(self) -> dict[str, str]:
        """Results by name."""
        shown = [one.split() for one in self.shows.split(", ") if one]
        forms = {
            name: path.format(other[0] if other else self.name)
            for kind, *other in shown
            for name, path in FORMS[kind].items()
        }
        return forms | dict(self.files)

    @property
    def wildcards(self) -> dict[str, str]:
        """Patterns of the wildcards of its files."""
        return {name: WILDCARDS[name] for name in self._wildcards if name in WILDCARDS}

    @property
    def log(self) -> str:
        """Name of its log and benchmark, with its wildcards."""
        each = "-".join(f"{{{name}}}" for name in self._wildcards)
        return f"{self.name}/{each}" if each else self.name

    @property
    def _wildcards(self) -> list[str]:
        return re.findall(r"{(\w+)}", next(iter(self.outputs.values())))

    @property
    def category(self) -> str:
        """Chapter of the report."""
        kind, _, rest = self.name.partition("_")
        numbered = rest.split("_")[0] if kind in ("figure", "table") else ""
        return CHAPTERS.get(self.chapter or numbered, BEYOND)

    def shown(self, run: StudyRun) -> list[Described]:
        """Captures of a run that it is made from."""
        return list(Selection(run).value(self.captures)) if self.captures else []

    def in_run(self, run: StudyRun) -> bool:
        """Whether a run makes it."""
        there = not self.captures or bool(self.shown(run))
        return there and (not self.made or bool(Selection(run).value(self.made)))

    def rule_inputs(self, run: StudyRun) -> dict:
        """Inputs of its rule."""
        selection = Selection(run, self.shown(run))
        return {name: selection.value(token) for name, token in self.inputs.items()}

    def rule_params(self, run: StudyRun) -> dict:
        """Params of its rule."""
        selection = Selection(run, captures := self.shown(run))
        described = {"captures": captures} if self.captures else {}
        found = {name: selection.value(token) for name, token in self.params.items()}
        known = {"make": self.make, "title": self.title, "caption": self.caption}
        return known | described | dict(self.values) | found

    def rule_outputs(self, run: StudyRun) -> dict[str, str]:
        """Paths of its files by name."""
        return {name: run.results(path) for name, path in self.outputs.items()}

    def reported(self, run: StudyRun, report: Callable, caption: str) -> dict:
        """Outputs of its rule; pictures and pages are put into the report.

        Parameters
        ----------
        run : StudyRun
        report : callable
            Snakemake's mark of what is in the report.
        caption : str
            File of the caption's template.
        """
        return {
            name: report(
                path, caption=caption, category=self.category, labels={"Result": self.label(name)}
            )
            if name == "png" or name.endswith("page")
            else path
            for name, path in self.rule_outputs(run).items()
        }

    def label(self, form: str) -> str:
        """Its line in the report; browsers sort these letter by letter."""
        if self.title.startswith(("Figure", "Table", "Equation")):
            # A hair's breadth sorts before digits, so that Figure 5.2 comes before Figure 5.10.
            return re.sub(r"^(\w+ \w\.)(\d:)", rf"\1{HAIR_SPACE}\2", self.title)
        return f"{self.title} ({'figure' if form == 'png' else 'table'})"


def _read(name: str, title: str, *, caption: str = "", **entry: Any) -> Artefact:
    # Folded text has one line's end for a paragraph's.
    text = caption.replace("\n", "\n\n")
    return Artefact(name, title, **{"message": title} | entry, caption=text)


_ENTRIES = yaml.load(TABLE.read_text(encoding="utf-8"), yaml.CSafeLoader)
ARTEFACTS: tuple[Artefact, ...] = tuple(_read(name, **entry) for name, entry in _ENTRIES.items())


def in_run(run: StudyRun) -> list[Artefact]:
    """Entries that a run can make."""
    return [entry for entry in ARTEFACTS if entry.in_run(run)]


def wanted_of(run: StudyRun) -> list[str]:
    """Files of the entries that a run makes for their own sake.

    Where a run has people's own objects alone, just those of recordings about the sensors.
    """
    others = {capture.object for capture in run.captures} - run.own
    return [
        path
        for entry in in_run(run)
        if entry.wanted and (others or entry.of_sensors)
        for path in entry.rule_outputs(run).values()
    ]
