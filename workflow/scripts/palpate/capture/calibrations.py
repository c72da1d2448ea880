"""What of a probe a run's films tell: which field of its file asks, and which film tells."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from palpate.config.probe import CALIBRATION, DEVIATIONS


@dataclass(frozen=True)
class Part:
    """A part of a probe that a film tells.

    Attributes
    ----------
    name : str
        Of ``results/sensors/<sensor>/<name>.json``.
    film : str
        Of ``raw/sensors/<sensor>/<film>``.
    shows : str
        What the film is of.
    deviations : mapping
        Fields of the probe's file that may say ``calibration``, and the field of what each is known
        to, which the film tells too.
    force : bool, optional
        Whether the film has a record of forces.
    """

    name: str
    film: str
    shows: str
    deviations: Mapping[str, str]
    force: bool = True

    def asking(self, probe: Mapping) -> str | None:
        """The first field of a probe's file that asks for the part."""
        return next((key for key in self.deviations if probe.get(key) == CALIBRATION), None)


# In the order in which they are taken: where the tip is in the sensor's frame hangs on its axes.
PARTS = (
    Part("load", "load", "the probe held free", DEVIATIONS["load"]),
    Part("tip", "pivot", "the turning handle", DEVIATIONS["tip"], force=False),
    Part("stiffness", "stiffness", "a press on something rigid", DEVIATIONS["stiffness"]),
)


def asked(probe: Mapping) -> dict[str, str]:
    """Parts that a probe's file asks for, as `PARTS` are ordered, each with its field."""
    return {part.name: field for part in PARTS if (field := part.asking(probe))}


def require_met(unmet: Mapping[str, str], probe: Mapping) -> None:
    """Refuse a probe's file that asks for parts, each with the field that does, of no calibration.

    Raises
    ------
    ValueError
    """
    for part, field in unmet.items():
        name = probe["probe"]
        expected = f"the {part}.json that the file of {name} asks for"
        raise ValueError(f"{field}: expected {expected}, found none")


def as_stated(probe: Mapping, known: Collection[str] = ()) -> Mapping:
    """A probe's file that asks for no part but known ones: what it states of others counts."""
    unknown = {field for part in PARTS if part.name not in known for field in part.deviations}
    return {k: v for k, v in probe.items() if not (k in unknown and v == CALIBRATION)}
