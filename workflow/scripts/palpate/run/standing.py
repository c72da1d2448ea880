"""What a run of one object (``only``) shows of the others: what their own last runs left."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from palpate.capture.discover import NOT_OBJECTS, discover, folders, sensor_folders
from palpate.capture.schema import load_yaml
from palpate.run.digest import ROOT, code, whole_code
from palpate.run.objects import kept_files, value_digest
from palpate.run.run import Described, Run

ORIGIN = "origin.txt"
# Of the configuration: what no number of an object hangs on.
APART = ("only", "paths")
# And of the workflow: what is made of numbers, but for the summary.
OF_ALL = ("rules/thesis.smk", "rules/report.smk", "scripts/thesis", "scripts/palpate/report")


@dataclass(frozen=True)
class Standing:
    """Objects beside the one that a run makes whose results stand and follow from what is there.

    Attributes
    ----------
    run : Run
    """

    run: Run

    def origin(self, name: str) -> str:
        """Digest of all that an object's results follow from."""
        run, path = self.run, Path(self.run.raw(f"{name}/object.yaml"))
        options = {key: value for key, value in run.config.items() if key not in APART}
        probe = run.probes.get(_declared(path).get("probe"))
        kept = kept_files(name, run.sensors, probe or {}, run.paths)
        films = name in (run.lab or {}).get("objects", {})
        if films and (not path.is_file() or _provenance(path) == "simulated"):
            content = run.lab
        else:
            content = run.object_fingerprint(name)
        seen_by = [place.folder.name for place in sensor_folders(run.raw(name))]
        seen_by += list((run.lab or {}).get("objects", {}).get(name, {}).get("recordings", {}))
        sensors = {one: run.sensors.get(one) for one in sorted(set(seen_by))}
        return value_digest([*self._code, options, sensors, probe, kept, content])

    def origin_of(self, wildcards: Any) -> str:
        """The same, for a rule."""
        return self.origin(wildcards.object)

    @cached_property
    def _code(self) -> list[str]:
        return [whole_code(apart=OF_ALL), code(ROOT / "stages/summary.py")]

    @cached_property
    def _others(self) -> dict[str, bool]:
        """Whether an object's results follow from what is there, by name."""
        if self.run.config["only"] is None:
            return {}
        names = [path.name for path in folders(self.run.paths["raw"])]
        others = [name for name in names if name not in (self.run.config["only"], *NOT_OBJECTS)]
        origins = {name: Path(self.run.results(f"{name}/{ORIGIN}")) for name in others}
        return {
            name: path.read_text(encoding="utf-8").strip() == self.origin(name)
            for name, path in origins.items()
            if path.is_file() and Path(self.run.results(f"{name}/summary.csv")).is_file()
        }

    @property
    def names(self) -> list[str]:
        """Those objects, sorted."""
        return sorted(name for name, holds in self._others.items() if holds)

    @property
    def paged(self) -> list[str]:
        """Those of them that have a page."""
        return [name for name in self.names if _is_file(self.run.results(f"{name}/report.html"))]

    def told(self, message: str) -> str:
        """A message, with the objects that are left out because something has changed since."""
        left = ", ".join(sorted(name for name, holds in self._others.items() if not holds))
        return f"{message}, without {left} (changed since its last run)" if left else message

    def tracked(self) -> list[Described]:
        """First tracked capture of each of the objects by each sensor."""
        there = [
            capture
            for capture in discover(self.run.paths["raw"])
            if capture.object in self.names
            and self._made(capture, f"tracked-{self.run.tracker}.npz", "hertz.json")
        ]
        first = {(c.object, c.sensor): c for c in reversed(there)}
        return [
            {
                **{key: getattr(capture, key) for key in ("object", "sensor", "capture", "point")},
                "provenance": _provenance(Path(self.run.raw(f"{capture.object}/object.yaml"))),
            }
            for _, capture in sorted(first.items())
        ]

    def minimised(self) -> list[Described]:
        """Those of them whose errors were minimised."""
        names = self.run.minima
        return [c for c in self.tracked() if all(map(_is_file, self.run.files([c], *names)))]

    def _made(self, capture: object, *names: str) -> bool:
        folder = f"{capture.object}/{capture.sensor}/{capture.capture}"
        return all(_is_file(self.run.results(f"{folder}/{name}")) for name in names)


def _is_file(path: str) -> bool:
    return Path(path).is_file()


def _declared(path: Path) -> Mapping:
    spec = load_yaml(path) if path.is_file() else None
    return spec if isinstance(spec, Mapping) else {}


def _provenance(path: Path) -> str:
    return _declared(path).get("provenance", "")
