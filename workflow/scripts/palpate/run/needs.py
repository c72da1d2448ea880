"""What of devices and films a job needs: what is wrong with others stops none."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate.capture.devices import read_devices
from palpate.run.refusal import refuse


class Needed(dict):
    """Specifications by name, None of a wrong one: to ask for that ends the run.

    Parameters
    ----------
    specs : mapping
    lacking : sequence of str
        All that the run lacks, which it ends with.
    """

    def __init__(self, specs: Mapping, lacking: Sequence[str]) -> None:
        super().__init__(specs)
        self.lacking = lacking

    def __getitem__(self, name: str) -> Any:
        spec = super().__getitem__(name)
        if spec is None:
            refuse(ValueError("\n".join(self.lacking)))
        return spec


def named_files(
    kind: str, folder: str, problems: list[str], lacking: list[str], needed: Mapping | None
) -> Mapping[str, Mapping | None]:
    """Specifications of sensors or probes by name, None of a wrong one.

    Parameters
    ----------
    kind : {"sensors", "probes"}
    folder : str
    problems, lacking : list of str
        Lines are added of what is wrong with ``needed`` ones, and with others.
    needed : mapping or None
        Names by kind; None: all are.
    """
    try:
        found = read_devices(kind, Path(folder), Path())
    except ValueError as error:
        problems.append(str(error))
        return {}
    for name, lines in found.problems.items():
        (problems if needed is None or name in needed[kind] else lacking).extend(lines)
    return found.specs


def lab_devices(lab: Mapping | None) -> dict[str, set[str]]:
    """Names of the sensors and probes that a lab films with, whatever is asked for."""
    objects = (lab or {}).get("objects", {}).values()
    blocks = (lab or {}).get("experiments", {}).values()
    sensors = [name for spec in objects for name in (*spec["recordings"], *spec["cameras"])]
    sensors += [name for block in blocks for name in block["sensors"]]
    probes = [spec["object"]["probe"] for spec in objects]
    probes += [block["probe"] for block in blocks if "probe" in block]
    return {"sensors": set(sensors), "probes": set(probes)}
