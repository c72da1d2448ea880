"""Which of the lab's captures the study takes: all of an object that it does not name."""

from collections.abc import Mapping

from palpate.capture.discover import CaptureId


def estimated(study: Mapping) -> Mapping:
    """Selection of what is estimated directly: the tracked, where nothing else is said."""
    return {**study["tracked"], **study.get("direct", {})}


def selected(capture: CaptureId, selection: Mapping) -> bool:
    """Whether the study uses a recording of the lab; all are of an object that it does not name."""
    chosen = selection.get(capture.object)
    return chosen is None or capture.capture in chosen.get(capture.sensor, [])


def unknown_captures(study: Mapping, simulated: set[CaptureId], source: str) -> list[str]:
    """Captures of the lab's objects that the study names and nobody records or the run leaves."""
    names = {capture.object for capture in simulated}
    used = {capture for capture in simulated if selected(capture, study["captures"])}
    allowed = {
        "captures": (simulated, "recordings of the lab"),
        "tracked": (used, "some of study.captures"),
        "direct": (used, "some of study.captures"),
    }
    return [
        f"{source}: study.{part}.{name}.{sensor}: expected {words}, found {capture}"
        for part, (known, words) in allowed.items()
        for name, sensors in study.get(part, {}).items()
        if name in names
        for sensor, captures in sensors.items()
        for capture in captures
        if CaptureId(name, sensor, capture) not in known
    ]
