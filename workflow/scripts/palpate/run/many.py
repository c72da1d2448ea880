"""Each object of raw/ as a run of its own: what the rules of workflow/objects.smk take."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from palpate.capture.discover import CaptureId
from palpate.run.digest import whole_code
from palpate.run.object_config import object_config
from palpate.run.objects import kept_files, studied, value_digest
from palpate.run.run import Run

# Of one core: what the largest job of an object's takes, see workflow/profiles/slurm.
CORE_MB = 1600
# On one core that has nothing else to do, with a margin of two (docs/cluster.md).
TABLE_MINUTES, CAPTURE_MINUTES, BASE_MINUTES = 6, 3, 10


@dataclass(frozen=True)
class ManyObjects:
    """Inputs and params of the rules that take each object as one job.

    Attributes
    ----------
    run : Run
        Without a lab: what stands in raw/ is taken as it is.
    """

    run: Run

    def of_object(self, name: str) -> str:
        """Pattern of a file about an object."""
        return self.run.results(f"objects/{{object}}{name}")

    def each(self, name: str) -> list[str]:
        """Such a file of every object."""
        return [self.of_object(name).format(object=one) for one in self.run.objects]

    def wanted(self, wildcards: Any) -> list[str]:
        """What an object's run makes; its configuration makes the rest where somebody wants it."""
        if wildcards.object in studied(self.run.config):
            return ["summary.csv", "figures/direct_moduli.png", "figures/tracked_surface.png"]
        if not self._captures[wildcards.object] or not self.run.shows_pages:
            return ["summary.csv"]
        own = ("report.html", "datapackage.json")
        return ["summary.csv", *(f"{wildcards.object}/{name}" for name in own)]

    def sensors(self, wildcards: Any) -> dict[str, Mapping]:
        """Sensors that filmed an object."""
        names = sorted({capture.sensor for capture in self._captures[wildcards.object]})
        return {name: self.run.sensors[name] for name in names}

    def probes(self, wildcards: Any) -> dict[str, Mapping]:
        """Probe that it was pressed with."""
        name = self.run.object_files[wildcards.object].get("probe")
        return {} if name is None else {name: self.run.probes[name]}

    def content(self, wildcards: Any, files: Iterable[str]) -> str:
        """Fingerprint of all that was dropped for an object, if a job is about one."""
        name = wildcards.get("object")
        return self.run.object_fingerprint(name) if name else ""

    def origin(self, wildcards: Any) -> str:
        """Digest of what an object's results follow from, beside its captures."""
        sensors, name = self.sensors(wildcards), wildcards.object
        options = object_config(self.run.config, name, self.of_object("").format(object=name))
        probes = self.probes(wildcards)
        kept = kept_files(name, sensors, next(iter(probes.values()), {}), self.run.paths)
        return value_digest([self._digest, options, sensors, probes, kept])

    def memory_mb(self, wildcards: Any, threads: int, attempt: int) -> int:
        """Memory of an object's run, doubled with each attempt."""
        return CORE_MB * threads * 2 ** (attempt - 1)

    def minutes(self, wildcards: Any, threads: int, attempt: int) -> int:
        """Time of an object: an indentation table of each point, and a film of each capture."""
        captures = self._captures[wildcards.object]
        curves = [one for one in self.run.curves if one.object == wildcards.object]
        work = CAPTURE_MINUTES * len(captures)
        work += TABLE_MINUTES * len({capture.point for capture in [*captures, *curves]})
        return int(BASE_MINUTES + work / threads) * 2 ** (attempt - 1)

    @cached_property
    def _captures(self) -> dict[str, list[CaptureId]]:
        found: dict[str, list[CaptureId]] = {name: [] for name in self.run.objects}
        for capture in self.run.captures:
            found[capture.object].append(capture)
        return found

    @cached_property
    def _digest(self) -> str:
        return whole_code()
