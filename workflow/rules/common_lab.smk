# Paths and parts of lab.yaml that the lab's rules and its accuracy tables need.
def lab_spec(wildcards):
    """An object's block of lab.yaml, but for what is recorded of it."""
    spec = HOUSE.lab["objects"][wildcards.object]
    return {
        key: value for key, value in spec.items() if key not in ("recordings", "scan")
    }


def lab_common(wildcards):
    """What all films of the lab share."""
    apart = ("objects", "experiments", "simulated_block", "laser")
    return {key: value for key, value in HOUSE.lab.items() if key not in apart}


def lab_shape(wildcards):
    return HOUSE.lab["objects"][wildcards.object]["shape"]


def drawn_form(wildcards):
    """File of the mesh that is an object's form, if one is."""
    return lab_shape(wildcards).get("file", [])


def laser_spec(wildcards):
    """The laser scanner, its views of an object, and the seed."""
    scan = HOUSE.lab["objects"][wildcards.object]["scan"]
    return HOUSE.lab["laser"] | scan | {"seed": HOUSE.lab["seed"]}


def lab_probe(wildcards):
    """Probe with which the lab presses one of its objects."""
    return HOUSE.probes[HOUSE.lab["objects"][wildcards.object]["object"]["probe"]]


def lab_mechanics(wildcards):
    """What the mechanics of an object depend on."""
    spec = lab_spec(wildcards)
    return {key: spec[key] for key in ("shape", "material", "contact")} | {
        "points": spec["object"]["points"]
    }


def ladder_of(wildcards):
    """Mechanics of a capture's point; mirror images of a symmetric object share one."""
    point = HOUSE.lab_point(wildcards.object, wildcards.capture.split("-")[0])
    return truth(f"{wildcards.object}/contact-{point}.npz")


def experiment_spec(wildcards):
    """An experiment's block of lab.yaml, with the object's where it presses one."""
    options = HOUSE.lab["experiments"][Path(wildcards.recording).name]
    if "object" not in options:
        return options
    return options | {"spec": HOUSE.lab["objects"][options["object"]]}


def experiment_sensor(wildcards):
    return HOUSE.sensors[Path(wildcards.recording).parent.name]


def experiment_probe(wildcards):
    """Probe of an experiment, if it has one."""
    options = experiment_spec(wildcards)
    if "spec" in options:
        return HOUSE.probes[options["spec"]["object"]["probe"]]
    return HOUSE.probes[options["probe"]] if "probe" in options else None


def experiment_ladder(wildcards):
    """Mechanics of the point that an experiment presses, if it does."""
    options = experiment_spec(wildcards)
    if "spec" not in options:
        return []
    point = HOUSE.lab_point(options["object"], options["point"])
    return truth(f"{options['object']}/contact-{point}.npz")


def simulated_spec(wildcards):
    return HOUSE.lab["simulated_block"]


def simulated_mesh(wildcards):
    return HOUSE.lab["simulated_block"]["mesh"]


def lab_truths():
    """Truth of every tracked capture that the lab makes."""
    return [
        f"{LAB}/{c['object']}/{c['sensor']}/{c['capture']}/truth.npz"
        for c in HOUSE.described(simulated=True, tracked=True)
    ]


def lab_materials():
    """True material of every object that the lab makes."""
    return [
        f"{LAB}/{name}/material.json"
        for name in sorted({c.object for c in HOUSE.simulated_captures})
    ]


def simulated_results():
    """What the accuracy table of every stage compares with the truth."""
    names = [
        "mask.npz",
        "probe_pose.csv",
        "force.csv",
        "clock.json",
        "clouds.npz",
        f"tracked-{TRACKER}.npz",
        "hertz.json",
    ]
    names += [f"minimise-{error}.json" for error in config["error_options"]]
    captures = HOUSE.described(simulated=True, tracked=True)
    return [path for name in names for path in files_of(captures, name)]


def compared_results(pattern):
    """A file of each compared tracker for each tracked capture that the lab makes."""
    captures = HOUSE.described(simulated=True, tracked=True)
    return [
        results(pattern.format(tracker=tracker, **capture))
        for capture in captures
        for tracker in config["tracking"]["compared"]
    ]


def lab_outputs():
    """Everything that the lab writes into raw/."""
    made = HOUSE.simulated
    captures = {f"{RAW}/{c.object}/{c.sensor}/{c.capture}" for c in made}
    backgrounds = {f"{RAW}/{c.object}/{c.sensor}/background" for c in made}
    objects = {f"{RAW}/{c.object}/object.yaml" for c in made}
    scans = {f"{RAW}/{c.object}/scans" for c in made}
    objects |= {
        f"{RAW}/{name}/template.ply" for name in set(LAB_OBJECTS) - set(SCANNED)
    }
    return sorted(captures | backgrounds | objects | scans) + lab_experiments()


def lab_experiments():
    """Recordings about the sensors and simulations, where the lab is to make them."""
    if HOUSE.lab is None or config["only"] is not None:
        return []
    recordings = [f"{RAW}/sensors/{name}" for name in sorted(HOUSE.lab_experiments)]
    simulated = [f"{RAW}/simulations/foam_block.npz"]
    return recordings + (simulated if "simulated_block" in HOUSE.lab else [])


def scanned_by_lab():
    """Objects of the lab whose templates come from its scans."""
    return sorted(set(LAB_OBJECTS) & set(SCANNED))


def first_truths(names):
    """Truth of one recording of each object, for its undeformed surface."""
    first = {c.object: c for c in sorted(HOUSE.simulated, reverse=True)}
    return [
        f"{LAB}/{name}/{first[name].sensor}/{first[name].capture}/truth.npz"
        for name in names
    ]
