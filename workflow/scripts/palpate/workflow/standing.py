"""What a run of one object (``only``) shows of the others: what their own last runs left."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from palpate.capture.discover import discover, folder_fingerprint, object_folders, sensor_folders
from palpate.config.probe import PARTS
from palpate.config.sensor import HAND_EYE, asks_for_base
from palpate.workflow.digest import ROOT, code
from palpate.workflow.run import Described, Run
from palpate.yaml_files import load_yaml

ORIGIN = "origin.txt"
# Of the configuration: what no number of an object depends on.
APART = ("only", "paths")


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
        return value_digest([stages, rules, options, sensors, probe, kept, content])

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


def value_digest(value: Any) -> str:
    """Digest plain values, sixteen hexadecimal digits; a run keeps it for each of its jobs."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:16]


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
