"""Which captures, files and values of a run the thesis's tables and figures are made from."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from string import Template
from types import SimpleNamespace
from typing import Any

from palpate.workflow.run import Described

from thesis.chapter1.moduli_rules import path_to_moduli
from thesis.run import BALL, EAR, captured
from thesis.sensor_selections import SensorSelection
from thesis.tracker.options import options_of

# Figures that need no tracked surface, and so may show any capture.
UNTRACKED_FIGURES = {"figure_5_2"}
# Fewest captures that make a map, and that make a spread.
FEWEST_POINTS, FEWEST_ATTEMPTS = 4, 3
# The point of Figure 5.6 lies at an end of the block.
END_POINT = "17"
# Trackers whose surfaces the figures show.
DRAWN_TRACKERS = {"study", "unrefined", "single_view"}
# What the accuracy of every stage is measured on, of a capture.
STAGES = ("mask.npz", "probe_pose.csv", "force.csv", "clock.json", "clouds.npz")


class Selection(SensorSelection):
    """A run and the captures that an artefact is made from; methods are the tokens of its table.

    Parameters
    ----------
    run : StudyRun
    captures : list of Described, optional
    """

    def value(self, token: str | list) -> Any:
        """Value of a token of `artefacts.yaml`, or of a list of them one after the other.

        Parameters
        ----------
        token : str or list of str
            A file, ``<root>/<path>`` or of each capture; or a method or attribute of this or of
            the run, with arguments.

        Raises
        ------
        AttributeError
            If it is none of these.
        """
        if isinstance(token, list):
            return [self.value(one) for one in token]
        name, *arguments = token.split()
        if "." in name or "/" in name:
            return self._file(name)
        found = getattr(self if hasattr(self, name) else self.run, name)
        return found(*arguments) if callable(found) else found

    def _file(self, text: str) -> str | list[str]:
        if "/" not in text:
            return self.each(f"results/$folder/{text}")
        return self._path(text, self.captures[0] if self.captures else {})

    def _path(self, text: str, capture: Mapping) -> str:
        known = {"tracker": self.run.tracker, "error": self.run.errors[0]} | dict(capture)
        if "capture" in capture:
            known["folder"] = "{object}/{sensor}/{capture}".format(**capture)
        root, _, path = Template(text).substitute(known).partition("/")
        return getattr(self.run, root)(path)

    # Captures.

    def shown(self, figure: str) -> list[Described]:
        """Captures that a figure shows: for each sensor the study's point, or else the first."""
        wanted = self.run.study["figure_points"].get(figure)
        every = self.run.described("captures" if figure in UNTRACKED_FIGURES else "tracked")
        ours = [capture for capture in every if capture["object"] == self.block] or every
        chosen = []
        for sensor in sorted({capture["sensor"] for capture in ours}):
            mine = [capture for capture in ours if capture["sensor"] == sensor]
            chosen.append(next((c for c in mine if c["capture"] == wanted), mine[0]))
        return chosen

    def first(self, *token: str) -> list:
        """The first of a token's values, in a list; empty where it has none."""
        return self.value(" ".join(token))[:1]

    def one(self, *token: str) -> Any:
        """The first of a token's values."""
        return self.value(" ".join(token))[0]

    def of_block(self, figure: str) -> list[Described]:
        """Captures of the block that a figure shows."""
        return [c for c in self.shown(figure) if c["object"] == self.block]

    def of_the_block(self) -> list[Described]:
        """Captures of the study's block."""
        return [capture for capture in self.run.described() if capture["object"] == self.block]

    def over_the_block(self, sensor: str | None = None) -> list[Described]:
        """Captures that are their point's only one: of a sensor, or of all with enough points."""
        single = [c for c in self.of_the_block() if c["capture"] == c["point"]]
        single = [c for c in single if c["point"].isdigit()]
        counts = [c["sensor"] for c in single]
        return [
            c
            for c in single
            if sensor in (None, c["sensor"]) and counts.count(c["sensor"]) >= FEWEST_POINTS
        ]

    def attempts(self) -> list[Described]:
        """Repeated indentations of the block: captures whose names carry an attempt, per sensor."""
        return [c for c in self.of_the_block() if c["capture"] != c["point"]]

    def repeated(self) -> list[Described]:
        """Attempts at the one point, by one sensor, that has most of them."""
        places: dict[tuple, list] = {}
        for capture in self.attempts():
            places.setdefault((capture["sensor"], capture["point"]), []).append(capture)
        most = max(places.values(), key=len, default=[])
        return most if len(most) >= FEWEST_ATTEMPTS else []

    def at_the_end(self) -> list[Described]:
        """Tracked captures of the block's end point."""
        wanted = self.run.study["figure_points"].get("figure_5_6", END_POINT)
        return [c for c in self.all_tracked() if c["capture"] == wanted]

    def all_tracked(self, name: str = "") -> list[Described]:
        """Every tracked capture of an object, the block by default."""
        return self.run.described_of("tracked", name or self.block)

    def table_5_3_captures(self) -> list[Described]:
        """The study's points of its block; of dropped captures all of the block."""
        wanted = self.run.study["table_5_3_points"]
        return [
            capture
            for capture in self.all_tracked()
            if capture["point"] in wanted or capture["provenance"] != "simulated"
        ]

    def traced(self) -> list[Described]:
        """Captures whose minimisations the study's figures show."""
        others = self.run.first_tracked(BALL) + self.run.first_tracked(EAR)
        return self.of_block("figure_5_8") + others

    def simulated(self, which: str = "captures") -> list[Described]:
        """Captures whose truth the lab knows: all, or those that a method runs on."""
        made = self.run.simulated
        return [c for c in self.run.described(which) if captured(c) in made]

    def stepped(self) -> list[Described]:
        """Simulated captures whose steps are shown: the block's of Table 5.3, all of others."""
        wanted = self.run.study["table_5_3_points"]
        return [
            capture
            for capture in self.simulated("tracked")
            if capture["object"] != self.block or capture["point"] in wanted
        ]

    def shrunk_balls(self) -> list[Described]:
        """Captures of the ball that are tracked from one view and from turned clouds."""
        both = {"study", "single_view"} <= set(self.run.config["tracking"]["trackers"])
        return self.run.first_tracked(BALL) if both else []

    def solids_counted(self) -> list[Described]:
        """First tracked capture of each object whose solid the study counts the nodes of."""
        names = (self.block, BALL, EAR)
        return [mine[0] for mine in map(self.all_tracked, names) if mine]

    def pressed_points(self) -> list[Described]:
        """A simulated capture of each point of an object that the lab solves by itself."""
        found: dict[tuple[str, str], Described] = {}
        for capture in self.simulated("direct"):
            name, point = capture["object"], capture["point"]
            found.setdefault((name, self.run.lab_point(name, point)), capture)
        return list(found.values())

    def objects_shown(self) -> list[Described]:
        """Tracked captures that the page of objects shows: one per object and sensor."""
        others = sorted({c.object for c in self.run.tracked} - {self.block})
        mine = self.of_block("tracked_surface")
        return [*mine, *(capture for name in others for capture in self.run.first_tracked(name))]

    # Files and values of captures.

    def each(self, path: str) -> list[str]:
        """A file of each capture."""
        return [self._path(path, capture) for capture in self.captures]

    def of(self, path: str, *token: str) -> list[str]:
        """A file of each of a token's values: captures, groups, or names ($name)."""
        places = [{"name": v} if isinstance(v, str) else v for v in self.value(" ".join(token))]
        return [self._path(path, place) for place in places]

    def where(self, condition: str, path: str) -> str | list:
        """A file where a condition holds, else none."""
        return self._file(path) if self.value(condition) else []

    def templates(self) -> list[str]:
        """Template of each capture's object."""
        return [self.run.template_of(SimpleNamespace(**capture)) for capture in self.captures]

    def minima(self) -> list[str]:
        """Minima of captures, by capture and then by error option."""
        return self.run.files(self.captures, *self.run.minima)

    def material(self, name: str = "") -> str | list:
        """True material of an object, the block by default, where the lab makes it."""
        known = name or self.block
        return self.run.truth(f"{known}/material.json") if known in self.run.made_materials else []

    def probes_used(self) -> list[Mapping]:
        """Probe of each capture."""
        return [self.run.probe_spec(SimpleNamespace(**capture)) for capture in self.captures]

    def sensors_used(self) -> list[Mapping]:
        """Sensor of each capture."""
        return [self.run.sensors[capture["sensor"]] for capture in self.captures]

    def optics(self) -> str | list:
        """Calibration of the capture's sensor, where its file asks for it."""
        return self.run.optics_of(SimpleNamespace(**self.captures[0]))

    def calibrations(self) -> list[str]:
        """Calibration of each sensor whose file asks for it."""
        found = (self.run.optics_of(SimpleNamespace(**capture)) for capture in self.captures)
        return [path for path in found if path]

    def in_colour(self, figure: str) -> bool:
        """Whether the capture that a figure shows has colours."""
        capture = self.of_block(figure)[0]
        return self.run.sensors[capture["sensor"]]["color"]["encoding"] != "mono8"

    def tracker_options(self, tracker: str) -> list[Mapping]:
        """Options of a tracker for each capture's object."""
        return [
            options_of(self.run.config["tracking"], tracker, c["object"]) for c in self.captures
        ]

    def draws_trackers(self) -> bool:
        """Whether the run has the trackers that the figures of tracked surfaces show."""
        return set(self.run.config["tracking"]["trackers"]) >= DRAWN_TRACKERS

    def steps_trackers(self) -> list[str]:
        """Trackers that the steps of the error minimisation may use."""
        return list(dict.fromkeys([self.run.tracker, *self.run.config["tracking"]["compared"]]))

    def steps_surfaces(self) -> list[str]:
        """Their surfaces of a job's capture."""
        return [self.run.of_capture(f"tracked-{name}.npz") for name in self.steps_trackers()]

    def steps(self) -> dict:
        """Steps of the error minimisation whose tracker this run has made."""
        return {
            name: step
            for name, step in self.run.config["minimise"]["steps"].items()
            if step.get("tracker", self.run.tracker) in self.steps_trackers()
        }

    # What the run is asked for.

    def config(self, *names: str) -> Any:
        """A value of the configuration."""
        found = self.run.config
        for name in names:
            found = found[name]
        return found

    @property
    def last_error(self) -> str:
        """Error option whose steps are drawn."""
        return self.run.errors[-1]

    def of_job(self, name: str) -> Callable:
        """A method of the run that takes each job's wildcards."""
        return getattr(self.run, name)

    def wildcard(self, name: str) -> Callable:
        """A job's wildcard."""
        return lambda wildcards: getattr(wildcards, name)

    def rules_to_moduli(self) -> Callable:
        """Rules from a capture to its moduli, once all are there."""
        return lambda wildcards: path_to_moduli(self.run, self.run.rules)

    def results_folder(self) -> Callable:
        """Folder of all results, from a table's."""
        return lambda wildcards, output: str(Path(output.csv).parents[1])

    # Of comparison and accuracy.

    def our_tables(self) -> list[str]:
        """Tables of the run that have counterparts of printed numbers or bear on findings."""
        made = {
            "cd_case": self.experiments("cd_case"),
            "equation_4_12": self.experiments("calibration"),
            "pipeline_accuracy": self.simulated("tracked"),
            "simulation": self.has_simulation(),
            "simulation_noise": self.has_simulation(),
            "table_4_1": self.experiments("calibration"),
            "table_4_2": self.experiments("workspace"),
            "table_5_1": self.attempts(),
            "table_5_2": True,
        }
        names = [f"tables/{name}.csv" for name, there in made.items() if there]
        return [self.run.results(path) for path in ("summary.csv", *names)]

    def groups_of_shown(self) -> list[dict[str, str]]:
        """What is estimated of the object of the capture that is shown."""
        return self.run.groups(self.captures[0]["object"])

    def knows_shown(self, figure: str) -> bool:
        """Whether the lab knows the material of what a figure shows."""
        return any(c["object"] in self.run.made_materials for c in self.shown(figure)[:1])

    def contact_solutions(self) -> list[str]:
        """The lab's own contact solution of each capture's point."""
        points = [self.run.lab_point(c["object"], c["point"]) for c in self.captures]
        pairs = zip(self.captures, points, strict=True)
        return [self.run.truth(f"{c['object']}/contact-{point}.npz") for c, point in pairs]

    def stage_results(self) -> list[str]:
        """Results of every stage, stage by stage."""
        surfaces = f"tracked-{self.run.tracker}.npz"
        names = [*STAGES, surfaces, "hertz.json", *self.run.minima]
        return [path for name in names for path in self.run.files(self.captures, name)]

    def compared(self, pattern: str) -> list[str]:
        """A file of each capture and each tracker that is compared."""
        trackers = self.run.config["tracking"]["compared"]
        each = [partial(pattern.format, **capture) for capture in self.captures]
        return [self.run.results(path(tracker=name)) for path in each for name in trackers]

    def scanned_by_lab(self) -> list[str]:
        """Objects whose scans the lab makes."""
        return sorted(set(self.run.lab_objects) & set(self.run.scanned))

    def scanned_captures(self) -> list[Described]:
        """One recording of each, whose truth has its undeformed surface."""
        first = {c.object: vars(c) for c in sorted(self.run.simulated, reverse=True)}
        return [first[name] for name in self.scanned_by_lab()]
