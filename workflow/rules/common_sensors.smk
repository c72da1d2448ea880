# Recordings about the sensors: which there are, and what is made of them.
def sensors_of(experiment):
    """Sensors of which there is an experiment, the lab's or dropped."""
    done = {Path(name) for name in HOUSE.lab_experiments}
    made = {path.parent.name for path in done if path.name == experiment}
    dropped = {
        name
        for name in HOUSE.sensors
        if Path(RAW, "sensors", name, experiment).is_dir()
    }
    return sorted(made | dropped)


def sensor_files(experiment, name):
    """A file of each sensor of which there is an experiment."""
    return [f"{RESULTS}/sensors/{sensor}/{name}" for sensor in sensors_of(experiment)]


def raw_of_sensors(experiment):
    """Folders of an experiment."""
    return [f"{RAW}/sensors/{sensor}/{experiment}" for sensor in sensors_of(experiment)]


def experiment_content(experiment):
    """Fingerprint of a dropped experiment; the lab's follow from its configuration."""

    def fingerprint(wildcards):
        if f"{wildcards.sensor}/{experiment}" in HOUSE.lab_experiments:
            return "lab"
        return fingerprint_of(f"{RAW}/sensors/{wildcards.sensor}/{experiment}")

    return fingerprint


def experiment_provenance(experiment):
    """Whether sensors' recordings of an experiment are simulated, by sensor."""
    return {
        sensor: (
            "simulated"
            if f"{sensor}/{experiment}" in HOUSE.lab_experiments
            or is_simulated(f"{RAW}/sensors/{sensor}/{experiment}")
            else "recorded"
        )
        for sensor in sensors_of(experiment)
    }


# What is made of each experiment about a sensor.
READINGS = {
    "calibration": "calibration.json",
    "workspace": "workspace.csv",
    "cd_case": "cd_case_path.csv",
    "loading": "loading.csv",
}


def read_experiments():
    """Sensors and names of the lab's experiments that are held against its truth."""
    pairs = [
        (Path(name).parent.name, Path(name).name) for name in HOUSE.lab_experiments
    ]
    return sorted(pair for pair in pairs if pair[1] in READINGS)


def seeing_outputs():
    """Tables and figures of Chapter 4, where their experiments are there."""
    made = {
        "calibration": ["tables/table_4_1.csv", "tables/equation_4_12.csv"]
        + [f"figures/figure_4_{n}.png" for n in (9, 10)],
        "workspace": ["tables/table_4_2.csv"]
        + [f"figures/figure_4_{n}.png" for n in range(14, 20)],
        "cd_case": ["tables/cd_case.csv"]
        + [f"figures/figure_4_{n}.png" for n in (13, 20, 21)],
        "loading": ["figures/figure_4_6.png"],
    }
    files = [file for name in made if sensors_of(name) for file in made[name]]
    accuracy = ["tables/sensor_accuracy.csv"] if read_experiments() else []
    return [f"{RESULTS}/{file}" for file in files + accuracy]


def experiments_probe(wildcards):
    """Probe of the recordings about the sensors."""
    return HOUSE.probes[config["experiments"]["probe"]]


def optics_of(wildcards):
    """A sensor's own calibration, where its file asks for it."""
    if HOUSE.sensors[wildcards.sensor].get("optics") != "calibration":
        return []
    return results(f"sensors/{wildcards.sensor}/calibration.json")
