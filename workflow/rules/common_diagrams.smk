# What the diagrams of the sensors and the views of the rig are drawn from.
from snakemake.io import strip_wildcard_constraints

# Depth of a drawn point where no placement is configured, in nearest depths of the sensor.
DRAWN_AWAY = 1.5


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


def rig_outputs():
    """Figures of the rig and its optics that the configured sensors give."""
    made = {
        "figure_1_1": bool(HOUSE.tracked),
        "figure_4_2": dot_sensor(),
        "figure_4_3": of_kind("stereo"),
        "figure_4_8": pinhole_sensor(),
    }
    return [f"{RESULTS}/figures/{name}.png" for name, there in made.items() if there]
