# Objects of people's own: what is made of each, with nothing said of it in any configuration.
# Objects of the study: its tables and figures are theirs, even of dropped recordings.
STUDIED = studied(config)
OWN_OBJECTS = sorted(
    {capture.object for capture in HOUSE.captures} - STUDIED - set(LAB_OBJECTS)
)
OWN_FIGURES = ["moduli", "hertz_fit", "surface"]
# Of Hertz fits in one figure.
MOST_FITS = 4


def all_own():
    """Whether nothing of the study, and nothing of the lab's, is in the run."""
    return {capture.object for capture in HOUSE.captures} <= set(OWN_OBJECTS)


def own_sensor_outputs():
    """Reports on the sensors, where people recorded any."""
    return seeing_outputs() if config["only"] is None else []


def captures_of(wildcards):
    """Described captures of an object."""
    return [c for c in HOUSE.described() if c["object"] == wildcards.object]


def groups_of(wildcards):
    """Object and sensors whose captures are estimated together."""
    return [g for g in direct_groups() if g["object"] == wildcards.object]


def first_of(wildcards):
    """First capture of an object by each sensor."""
    return tracked_of(wildcards.object)


def fitted_of(wildcards):
    """First captures of an object, as many as a figure of Hertz fits holds."""
    firsts = first_of(wildcards)
    rest = [c for c in captures_of(wildcards) if c not in firsts]
    return (firsts + rest)[:MOST_FITS]


def each(captures, *names):
    """Files of an object's captures, those of one capture after those of another."""

    def files(wildcards):
        return [
            path
            for capture in captures(wildcards)
            for name in names
            for path in files_of([capture], name)
        ]

    return files


def together_of(wildcards):
    """Estimates from all captures of an object with a sensor."""
    return [
        results(f"{g['object']}/{g['sensor']}/direct.json")
        for g in groups_of(wildcards)
    ]


def recorded_of(wildcards):
    return recordings_of(first_of(wildcards))


def sensors_of_first(wildcards):
    return sensors_shown(first_of(wildcards))


def own_outputs():
    """Page, summary and figures of every object of people's own."""
    names = ["report.html", "summary.csv"]
    names += [f"figures/{name}.{end}" for name in OWN_FIGURES for end in ("png", "svg")]
    return [results(f"{own}/{name}") for own in OWN_OBJECTS for name in names]
