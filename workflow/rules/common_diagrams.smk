# What the diagrams of the sensors and the views of the rig are drawn from.
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


def rig_outputs():
    """Figures of the rig and its optics that the configured sensors give."""
    made = {
        "figure_4_2": dot_sensor(),
        "figure_4_3": of_kind("stereo"),
        "figure_4_8": pinhole_sensor(),
    }
    return [f"{RESULTS}/figures/{name}.png" for name, there in made.items() if there]
