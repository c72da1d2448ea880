"""Objects of people's own, with nothing said of them in any configuration.

What is made of each, and what a run of one of them (``only``) shows of the others: what their own
last runs left.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os.path import isfile
from pathlib import Path
from typing import Any

from palpate.capture.discover import discover, folder_fingerprint, object_folders, sensor_folders
from palpate.config.probe import PARTS
from palpate.config.sensor import HAND_EYE, asks_for_base
from palpate.workflow.digest import ROOT, code
from palpate.workflow.run import Described, Run
from palpate.yaml_files import load_yaml

# Of Hertz fits in one figure.
MOST_FITS = 4
DATA = ("force", "motion", "samples", "profile")
ORIGIN = "origin.txt"
# Of the configuration: what no number of an object depends on.
APART = ("only", "paths")


@dataclass(frozen=True)
class OwnObjects:
    """Inputs and params of the rules of people's own objects, of a run."""

    run: Run

    @property
    def names(self) -> list[str]:
        """Those objects, in order."""
        return sorted(self.run.own)

    @property
    def summed(self) -> list[str]:
        """All objects of the run, each of which has a summary."""
        return sorted({one.object for one in (*self.run.captures, *self.run.curves)})

    def summaries(self, others: Sequence[str]) -> list[str]:
        """Summary of each of them and of others, by object."""
        names = sorted({*self.summed, *others})
        return [self.run.results(f"{name}/summary.csv") for name in names]

    def outputs(self, figures: Iterable[str]) -> list[str]:
        """Summary of every object, and page, figures and data of those whose methods they show."""
        files = ["report.html", "datapackage.json", *(f"data/{name}.csv" for name in DATA)]
        files += [f"figures/{name}.{end}" for name in figures for end in ("png", "svg")]
        found = [self.run.results(f"{own}/{name}") for own in self.paged for name in files]
        return found + self.summaries(())

    @property
    def paged(self) -> list[str]:
        """Those of them that get a page."""
        return self.names if {"hertz", "direct"} <= set(self.run.config["methods"]) else []

    def pages(self) -> list[str]:
        """Pages that are there, of those objects."""
        found = [self.run.results(f"{own}/report.html") for own in self.names]
        return [path for path in found if isfile(path)]

    def of(self, which: str) -> Callable[[Any], list[Described]]:
        """Captures of an object that a method runs on; see `Run.described`."""
        return lambda wildcards: self.run.described_of(which, wildcards.object)

    def captures(self, wildcards: Any) -> list[Described]:
        """Captures of an object."""
        return self.run.described_of("captures", wildcards.object)

    def points(self, wildcards: Any) -> list[str]:
        """Points of an object's captures."""
        return list(dict.fromkeys(capture["point"] for capture in self.captures(wildcards)))

    def tables(self, wildcards: Any) -> list[str]:
        """Indentation tables of those points."""
        return [self.run.table(wildcards.object, point) for point in self.points(wildcards)]

    def first(self, wildcards: Any) -> list[Described]:
        """First capture of an object by each sensor."""
        return self.run.first_tracked(wildcards.object)

    def fitted(self, wildcards: Any) -> list[Described]:
        """First captures of an object, as many as a figure of Hertz fits holds."""
        firsts = self.first(wildcards)
        return [*firsts, *(c for c in self.captures(wildcards) if c not in firsts)][:MOST_FITS]

    def groups(self, wildcards: Any) -> list[Described]:
        """Object and sensors whose captures are estimated together."""
        return self.run.groups(wildcards.object)

    def joint(self, name: str = "direct.json") -> Callable[[Any], list[str]]:
        """Estimates from all captures of an object with a sensor, or files beside them."""
        place = f"{{object}}/{{sensor}}/{name}"
        return lambda wildcards: [
            self.run.results(place.format(**group)) for group in self.groups(wildcards)
        ]

    def masks(self, wildcards: Any) -> list[str]:
        """Masks of those first captures that have pictures."""
        seen = [c for c in self.first(wildcards) if "color" in self.run.sensors[c["sensor"]]]
        return self.run.files(seen, "mask.npz")

    def sensors(self, wildcards: Any) -> list[Mapping]:
        """Sensors of the first captures of an object."""
        return [self.run.sensors[c["sensor"]] for c in self.first(wildcards)]

    def optics(self, wildcards: Any) -> list[str]:
        """Calibrations of those that have one of their own."""
        own = [s["sensor"] for s in self.sensors(wildcards) if s.get("optics") == "calibration"]
        return [self.run.results(f"sensors/{name}/calibration.json") for name in own]

    def recorded(self, captures: Callable[[Any], Sequence[Described]]) -> Callable:
        """Folders of an object's captures."""
        place = "{object}/{sensor}/{capture}"
        return lambda wildcards: [self.run.raw(place.format(**c)) for c in captures(wildcards)]

    def files(self, captures: Callable[[Any], Sequence[Described]], *names: str) -> Callable:
        """Files of an object's captures; see `Run.files`."""
        return lambda wildcards: self.run.files(captures(wildcards), *names)


@dataclass(frozen=True)
class Standing:
    """Objects beside the one that a run makes whose results follow from what is there."""

    run: Run

    def origin(self, name: str) -> str:
        """Digest of all that an object's results follow from."""
        run, spec = self.run, self._declared(name)
        options = {key: value for key, value in run.config.items() if key not in APART}
        probe = run.probes.get(spec.get("probe"))
        kept = kept_files(name, run.sensors, probe or {}, run.paths)
        films = (run.lab or {}).get("objects", {}).get(name)
        simulated = films and spec.get("provenance", "simulated") == "simulated"
        content = run.lab if simulated else folder_fingerprint(run.raw(name), linked=2)
        seen_by = {place.folder.name for place in sensor_folders(run.raw(name))}
        seen_by |= set((films or {}).get("recordings", {}))
        sensors = {one: run.sensors.get(one) for one in sorted(seen_by)}
        stages, rules = code(ROOT / "stages"), code(ROOT.parent / "rules")
        all_of = json.dumps([stages, rules, options, sensors, probe, kept, content], sort_keys=True)
        return hashlib.sha256(all_of.encode()).hexdigest()[:16]

    @cached_property
    def _others(self) -> dict[str, bool]:
        """Whether an object's results follow from what is there, by name."""
        run, only, found = self.run, self.run.config["only"], {}
        for folder in object_folders(run.paths["raw"]) if only is not None else ():
            name = folder.name
            if name != only and self._has(f"{name}/{ORIGIN}", f"{name}/summary.csv"):
                left = Path(run.results(f"{name}/{ORIGIN}")).read_text(encoding="utf-8")
                found[name] = left.strip() == self.origin(name)
        return found

    def _has(self, *names: str) -> bool:
        return all(Path(self.run.results(name)).is_file() for name in names)

    def _declared(self, name: str) -> Mapping:
        path = Path(self.run.raw(f"{name}/object.yaml"))
        spec = load_yaml(path) if path.is_file() else None
        return spec if isinstance(spec, Mapping) else {}

    @property
    def names(self) -> list[str]:
        """Those objects, sorted."""
        return sorted(name for name, holds in self._others.items() if holds)

    @property
    def paged(self) -> list[str]:
        """Those of them that have a page."""
        return [name for name in self.names if self._has(f"{name}/report.html")]

    def told(self, message: str) -> str:
        """A message, with the objects that are left out because something has changed since."""
        left = ", ".join(sorted(name for name, holds in self._others.items() if not holds))
        return f"{message}, without {left} (changed since its last run)" if left else message

    def tracked(self) -> list[Described]:
        """First tracked capture of each of the objects by each sensor."""
        wanted, first = (f"tracked-{self.run.tracker}.npz", "hertz.json"), {}
        for c in discover(self.run.paths["raw"]) if self.names else ():
            folder = f"{c.object}/{c.sensor}/{c.capture}"
            if c.object in self.names and self._has(*(f"{folder}/{name}" for name in wanted)):
                first.setdefault((c.object, c.sensor), c)
        said = {name: self._declared(name).get("provenance", "") for name in self.names}
        firsts = [c for _, c in sorted(first.items())]
        return [{**vars(c), "point": c.point, "provenance": said[c.object]} for c in firsts]


def kept_files(name: str, sensors: Mapping, probe: Mapping, paths: Mapping) -> dict[str, str]:
    """Fingerprints of what stands outside an object's folder and its results depend on."""
    # A recording of a probe counts where the probe's file asks for what it shows.
    films = [part.recording for part in PARTS if part.asking(probe)]
    prints = {}
    for sensor, spec in sensors.items():
        own = ["calibration"] * ((spec or {}).get("optics") == "calibration")
        own += [HAND_EYE] * asks_for_base(spec or {})
        for folder in [Path(paths["raw"], "sensors", sensor, one) for one in (*own, *films)]:
            if folder.is_dir():
                prints[f"{sensor}/{folder.name}"] = folder_fingerprint(folder)
    mesh = Path(paths["meshes"]) / f"{name}.vtu"
    if mesh.is_file():
        prints["mesh"] = hashlib.sha256(mesh.read_bytes()).hexdigest()[:16]
    return prints
