"""What an entry of the table of artefacts is: one rule, its files, its caption, its function."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from palpate.workflow.run import Described, Run

# Browsers sort results by name, letter for letter.
HAIR_SPACE = "\u200a"
Inputs = Callable[[Run, Sequence[Described]], Mapping[str, Any]]
CHAPTERS = {
    "1": "1 The system",
    "3": "3 Models and simulation",
    "4": "4 Seeing",
    "5": "5 Experiments",
    "a": "A Appendix",
}
COMPARISON = "Beside the study"
ACCURACY = "Accuracy of the simulated captures"
BEYOND = "Beyond the study"


def nothing(run: Run, captures: Sequence[Described]) -> dict:
    """No inputs, or no params."""
    return {}


@dataclass(frozen=True)
class Artefact:
    """One rule of the thesis.

    Attributes
    ----------
    name : str
        Of the rule, and of its files where `outputs` says nothing else.
    title : str
        What the report and the run's lines call it.
    caption : str
        What the report says below the title, in reStructuredText.
    make : str
        ``module:function``; takes the rule's inputs and params, returns what
        `palpate.report.outputs.write` writes. The rule is done anew when the module changes, or
        anything that it imports.
    outputs : mapping
        Results by name; see `figure`, `table` and `both`.
    captures : callable, optional
        Captures that it is made from, of a run; they are its param ``captures``, and a run that
        has none leaves it out.
    inputs, params : callable, optional
        Files and values by name, of a run and those captures.
    made : callable, optional
        Whether a run makes it at all.
    wanted : bool, optional
        Whether a run makes it for its own sake; else where others need it.
    chapter : str, optional
        Where the report shows it; from the name's number by default.
    priority : int, optional
        Of its jobs; the greater begin first.
    local : bool, optional
        Whether it is done in a second, and no entry of a cluster's queue.
    wildcards : mapping, optional
        Patterns of the wildcards of its files.
    log_name : str, optional
        With its wildcards; its name by default.
    message : str, optional
        What the run's lines call it; its title by default.
    """

    name: str
    title: str
    caption: str
    make: str
    outputs: Mapping[str, str]
    captures: Callable[[Run], Sequence[Described]] | None = None
    inputs: Inputs = nothing
    params: Inputs = nothing
    made: Callable[[Run], object] | None = None
    wanted: bool = True
    chapter: str = ""
    priority: int = 0
    local: bool = False
    wildcards: Mapping[str, str] = field(default_factory=dict)
    log_name: str = ""
    message: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "message", self.message or self.title)

    @property
    def log(self) -> str:
        """Name of its log and benchmark, with its wildcards."""
        return self.log_name or self.name

    def shown(self, run: Run) -> list[Described]:
        """Captures of a run that it is made from."""
        return list(self.captures(run)) if self.captures else []

    def in_run(self, run: Run) -> bool:
        """Whether a run makes it."""
        there = self.captures is None or bool(self.shown(run))
        return there and (self.made is None or bool(self.made(run)))

    @property
    def category(self) -> str:
        """Chapter of the report."""
        parts = self.name.split("_")
        if not self.chapter and parts[0] in ("figure", "table"):
            return CHAPTERS[parts[1]]
        return self.chapter or BEYOND

    def rule_inputs(self, run: Run) -> dict:
        """Inputs of its rule."""
        return dict(self.inputs(run, self.shown(run)))

    def rule_params(self, run: Run) -> dict:
        """Params of its rule."""
        captures = self.shown(run)
        known = {"make": self.make, "title": self.title, "caption": self.caption}
        described = {"captures": captures} if self.captures else {}
        return known | described | dict(self.params(run, captures))

    def rule_outputs(self, run: Run) -> dict[str, str]:
        """Paths of its files by name."""
        return {name: run.results(path) for name, path in self.outputs.items()}

    def reported(self, run: Run, report: Callable, caption: str) -> dict:
        """Outputs of its rule; pictures and pages are put into the report.

        Parameters
        ----------
        run : Run
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


def figure(name: str) -> dict[str, str]:
    """Outputs of a figure."""
    return {"png": f"figures/{name}.png", "svg": f"figures/{name}.svg"}


def table(name: str) -> dict[str, str]:
    """Outputs of a table."""
    return {
        "csv": f"tables/{name}.csv",
        "md": f"tables/{name}.md",
        "page": f"pages/{name}.html",
    }
