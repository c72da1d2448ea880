"""What the diagrams of the sensors and the views of the rig are drawn from."""

from collections.abc import Mapping

from palpate.workflow.run import Run

from thesis import selections as select

# Depth of a drawn point where no placement is configured, in nearest depths of the sensor.
DRAWN_AWAY = 1.5
# Point of the block that the setups of Figure 4.7 show pressed.
SHOWN_POINT = "11"


def of_kind(run: Run, kind: str) -> str | None:
    """First sensor of a kind, by name, whose file is right; none where there is no such sensor."""
    right = {name: spec for name, spec in run.sensors.items() if spec}
    return next((name for name in sorted(right) if right[name]["kind"] == kind), None)


def dot_sensor(run: Run) -> str | None:
    """Structured-light sensor that writes disparities (Eq. 4.2)."""
    name = of_kind(run, "structured_light")
    if name and run.sensors[name]["depth"]["encoding"] == "kinect_disparity":
        return name
    return None


def pinhole_sensor(run: Run) -> str | None:
    """Sensor whose colour camera Figure 4.8 shows: one that needs a calibration, or any."""
    return of_kind(run, "structured_light") or of_kind(run, "stereo")


def drawn_probe(run: Run) -> Mapping:
    """Probe that Figure 4.5 shows: the first, by name, whose file is right."""
    return next(spec for _, spec in sorted(run.probes.items()) if spec)


def placements(run: Run, name: str) -> Mapping:
    """Where the sensors stand before an object of the lab."""
    spec = run.lab["objects"].get(name, {}) if run.lab else {}
    return spec.get("cameras", {})


def drawn_depth(run: Run, name: str) -> float:
    """Distance of the sensor from the study's block, or what its range suggests [m]."""
    placement = placements(run, select.block(run)).get(name)
    if placement:
        return placement["distance_m"]
    return DRAWN_AWAY * run.sensors[name]["range_m"][0]


def setups(run: Run) -> list[dict]:
    """Each sensor that the lab puts before the study's block, with the probe on it."""
    block = select.block(run)
    if not placements(run, block):
        return []
    spec = run.lab["objects"][block]
    points = spec["object"]["points"]
    point = select.study(run)["figure_points"].get("figure_4_7", SHOWN_POINT)
    return [
        {
            "sensor": run.sensors[name],
            "probe": run.probes[spec["object"]["probe"]],
            "size_m": spec["shape"]["size_m"],
            "point_m": points.get(point, points[min(points)])["position_m"],
            "placement": placement,
        }
        for name, placement in sorted(placements(run, block).items())
        if "size_m" in spec["shape"]
    ]


def devices(run: Run) -> dict[str, dict]:
    """Stereo head, structured-light sensor and laser scanner, where all are configured."""
    found = {setup["sensor"]["kind"]: setup for setup in setups(run)}
    if not found or {"stereo", "structured_light"} - set(found):
        return {}
    spec = run.lab["objects"][select.block(run)]
    if "scan" not in spec:
        return {}
    scan = spec["scan"] | {"size_m": spec["shape"]["size_m"]}
    placed = {
        kind: {"sensor": s["sensor"], "distance_m": s["placement"]["distance_m"]}
        for kind, s in found.items()
    }
    return {"stereo": placed["stereo"], "dots": placed["structured_light"], "scan": scan}
