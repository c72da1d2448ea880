# What the diagrams of the sensors and the views of the rig are drawn from.
from snakemake.io import strip_wildcard_constraints

# Depth of a drawn point where no placement is configured, in nearest depths of the sensor.
DRAWN_AWAY = 1.5
# Point of the block that the setups of Figure 4.7 show pressed.
SHOWN_POINT = "11"


def of_kind(kind):
    """First sensor of a kind, by name; none where there is no such sensor."""
    return next(
        (n for n in sorted(HOUSE.sensors) if HOUSE.sensors[n]["kind"] == kind), None
    )


def dot_sensor():
    """Structured-light sensor that writes disparities (Eq. 4.2)."""
    name = of_kind("structured_light")
    if name and HOUSE.sensors[name]["depth"]["encoding"] == "kinect_disparity":
        return name
    return None


def pinhole_sensor():
    """Sensor whose colour camera Figure 4.8 shows: one that needs a calibration, or any."""
    return of_kind("structured_light") or of_kind("stereo")


def placements(name):
    """Where the sensors stand before an object of the lab."""
    spec = HOUSE.lab["objects"].get(name, {}) if HOUSE.lab else {}
    return spec.get("cameras", {})


def drawn_depth(name):
    """Distance of the sensor from the study's block, or what its range suggests [m]."""
    placement = placements(config["study"]["block"]).get(name)
    if placement:
        return placement["distance_m"]
    return DRAWN_AWAY * HOUSE.sensors[name]["range_m"][0] if name else None


def way_to_parameters(wildcards):
    """Rules from the recordings to (E, nu), found by asking each for its input.

    The way is walked back from the results of the first tracked capture of each object by each
    sensor: a new rule on the way comes by itself.
    """
    firsts = {(c.object, c.sensor): c for c in reversed(HOUSE.tracked)}
    wanted = {
        of_capture(f"minimise-{error}.json").format(**vars(capture))
        for capture in firsts.values()
        for error in ERRORS
    }
    found, waiting, seen = {}, sorted(wanted), set(wanted)
    while waiting:
        path = waiting.pop()
        writer = writer_of(path)
        names = writer.get_wildcards(path)
        entry = found.setdefault(
            writer.name, {"recorded": set(), "reads": {}, "wanted": set()}
        )
        entry["stage"] = Path(writer.snakefile).stem
        if path in wanted:
            entry["wanted"].add(pattern_of(writer, path))
        for needed in writer.expand_input(names)[0]:
            if str(needed).startswith(f"{RAW}/"):
                entry["recorded"].add(recording_name(needed))
            elif other := writer_of(needed):
                files = entry["reads"].setdefault(other.name, set())
                files.add(pattern_of(other, needed))
                if str(needed) not in seen:
                    seen.add(str(needed))
                    waiting.append(str(needed))
    return [
        {
            "rule": name,
            "stage": entry["stage"],
            "recorded": sorted(entry["recorded"]),
            "reads": {
                other: sorted(entry["reads"][other]) for other in sorted(entry["reads"])
            },
            "wanted": sorted(entry["wanted"]),
        }
        for name, entry in sorted(found.items())
    ]


def writer_of(path):
    """Rule that writes a result."""
    return next((step for step in workflow.rules if step.is_producer(str(path))), None)


def pattern_of(writer, path):
    """Name of a file as the rule that writes it has it, with its wildcards."""
    names = writer.get_wildcards(str(path))
    for pattern in map(strip_wildcard_constraints, writer.output):
        if pattern.format(**names) == str(path):
            return Path(pattern).name
    return Path(str(path)).name


def recording_name(path):
    """What a recording is, without whose it is."""
    captures = {raw(f"{c.object}/{c.sensor}/{c.capture}") for c in HOUSE.tracked}
    return "capture" if str(path) in captures else Path(str(path)).name


def setups():
    """Each sensor that the lab puts before the study's block, with the probe on it."""
    block = config["study"]["block"]
    if not placements(block):
        return []
    spec = HOUSE.lab["objects"][block]
    points = spec["object"]["points"]
    point = config["study"]["figure_points"].get("figure_4_7", SHOWN_POINT)
    return [
        {
            "sensor": HOUSE.sensors[name],
            "probe": HOUSE.probes[spec["object"]["probe"]],
            "size_m": spec["shape"]["size_m"],
            "point_m": points.get(point, points[min(points)])["position_m"],
            "placement": placement,
        }
        for name, placement in sorted(placements(block).items())
        if "size_m" in spec["shape"]
    ]


def devices():
    """Stereo head, structured-light sensor and laser scanner, where all are configured."""
    found = {setup["sensor"]["kind"]: setup for setup in setups()}
    if not found or {"stereo", "structured_light"} - set(found):
        return {}
    spec = HOUSE.lab["objects"][config["study"]["block"]]
    placed = {
        kind: {"sensor": s["sensor"], "distance_m": s["placement"]["distance_m"]}
        for kind, s in found.items()
    }
    if "scan" not in spec:
        return {}
    scan = spec["scan"] | {"size_m": spec["shape"]["size_m"]}
    return {
        "stereo": placed["stereo"],
        "dots": placed["structured_light"],
        "scan": scan,
    }


def clouds_shown():
    """Captures whose clouds Figure 4.4 shows: those of the tracked block of Figure 5.5."""
    return block_shown("figure_5_5")


def drawn_probe():
    """Probe that Figure 4.5 shows: the first, by name."""
    return HOUSE.probes[min(HOUSE.probes)]


def rig_outputs():
    """Figures of the rig and its optics that the configured sensors give."""
    made = {
        "figure_1_1": bool(HOUSE.tracked),
        "figure_4_1": bool(devices()),
        "figure_4_2": dot_sensor(),
        "figure_4_3": of_kind("stereo"),
        "figure_4_4": bool(clouds_shown()),
        "figure_4_5": bool(HOUSE.probes),
        "figure_4_7": bool(setups()),
        "figure_4_8": pinhole_sensor(),
    }
    return [f"{RESULTS}/figures/{name}.png" for name, there in made.items() if there]
