"""What is made of sensors, of recordings about them, and of the simulated block."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.workflow.configuration_checks import is_simulated
from palpate.workflow.run import Described

from thesis.run import StudyRun

# Depth of a drawn point where no placement is configured, in nearest depths of the sensor.
DRAWN_AWAY = 1.5
# Point of the block that the setups of Figure 4.7 show pressed.
SHOWN_POINT = "11"
# What is made of each experiment about a sensor.
READINGS = {
    "calibration": "calibration.json",
    "workspace": "workspace.csv",
    "cd_case": "cd_case_path.csv",
    "loading": "loading.csv",
}
SIMULATED_DATA = ("exact", "tracked")
STEPS = "simulations/foam_block.npz"


@dataclass(frozen=True)
class SensorSelection:
    """Sensors, probe and placements of a run.

    Attributes
    ----------
    run : StudyRun
    captures : sequence of Described, optional
        That an artefact is made from.
    """

    run: StudyRun
    captures: Sequence[Described] = ()

    @property
    def block(self) -> str:
        """Name of the study's block."""
        return self.run.study["block"]

    @property
    def whole(self) -> bool:
        """Whether the run is of all objects, and so of the recordings that are of none."""
        return self.run.config["only"] is None

    def drawn(self, which: str) -> str | None:
        """Name of the sensor that a diagram of a kind shows, the first whose file is right.

        Of ``stereo``; of ``dots``, structured light that writes disparities (Eq. 4.2); or of
        ``pinhole``, whose colour camera needs a calibration, or any.
        """
        stereo, dots = map(self._of_kind, ("stereo", "structured_light"))
        if which == "stereo":
            return stereo
        if which == "pinhole":
            return dots or stereo
        writes = dots and self.run.sensors[dots]["depth"]["encoding"] == "kinect_disparity"
        return dots if writes else None

    def _of_kind(self, kind: str) -> str | None:
        right = {name: spec for name, spec in self.run.sensors.items() if spec}
        return next((name for name in sorted(right) if right[name]["kind"] == kind), None)

    def drawn_sensor(self, which: str) -> Mapping:
        """Its file."""
        return self.run.sensors[self.drawn(which)]

    def drawn_depth(self, which: str) -> float:
        """Its distance from the study's block, or what its range suggests [m]."""
        placement = self._placements.get(self.drawn(which))
        if placement:
            return placement["distance_m"]
        return DRAWN_AWAY * self.drawn_sensor(which)["range_m"][0]

    def drawn_probe(self) -> Mapping:
        """Probe that Figure 4.5 shows: the first, by name, whose file is right."""
        return next(spec for _, spec in sorted(self.run.probes.items()) if spec)

    @property
    def _placements(self) -> Mapping:
        """Where the sensors stand before the block of the lab."""
        spec = self.run.lab["objects"].get(self.block, {}) if self.run.lab else {}
        return spec.get("cameras", {})

    def setups(self) -> list[dict]:
        """Each sensor that the lab puts before the study's block, with the probe on it."""
        if not self._placements:
            return []
        spec = self.run.lab["objects"][self.block]
        points = spec["object"]["points"]
        point = self.run.study["figure_points"].get("figure_4_7", SHOWN_POINT)
        return [
            {
                "sensor": self.run.sensors[name],
                "probe": self.run.probes[spec["object"]["probe"]],
                "size_m": spec["shape"]["size_m"],
                "point_m": points.get(point, points[min(points)])["position_m"],
                "placement": placement,
            }
            for name, placement in sorted(self._placements.items())
            if "size_m" in spec["shape"]
        ]

    def devices(self) -> dict[str, dict]:
        """Stereo head, structured-light sensor and laser scanner, where all are configured."""
        found = {setup["sensor"]["kind"]: setup for setup in self.setups()}
        if not found or {"stereo", "structured_light"} - set(found):
            return {}
        spec = self.run.lab["objects"][self.block]
        if "scan" not in spec:
            return {}
        placed = {
            kind: {"sensor": s["sensor"], "distance_m": s["placement"]["distance_m"]}
            for kind, s in found.items()
        }
        scan = spec["scan"] | {"size_m": spec["shape"]["size_m"]}
        return {"stereo": placed["stereo"], "dots": placed["structured_light"], "scan": scan}

    # Recordings about the sensors.

    def experiments(self, name: str) -> list[str]:
        """Sensors of which the run has an experiment."""
        return self.run.sensors_of(name) if self.whole else []

    def provenance(self, experiment: str) -> dict[str, str]:
        """Whether sensors' recordings of an experiment are simulated, by sensor."""
        made = self.run.lab_experiments
        return {
            sensor: (
                "simulated"
                if f"{sensor}/{experiment}" in made
                or is_simulated(self.run.raw(f"sensors/{sensor}/{experiment}"))
                else "recorded"
            )
            for sensor in self.run.sensors_of(experiment)
        }

    def calibrated(self) -> list[str]:
        """Sensor with a colour and an infrared camera that a run calibrates, the first."""
        found = self.experiments("calibration")
        return [sensor for sensor in found if "depth" in self.run.sensors[sensor]][:1]

    def calibrated_by_lab(self) -> dict[str, Mapping]:
        """Sensors whose calibration pictures the lab makes: their files hold the truth."""
        made = set(self.run.lab_experiments)
        known = self.run.sensors.items()
        return {name: spec for name, spec in known if f"{name}/calibration" in made}

    def compared_experiments(self, pattern: str) -> list[str]:
        """A file, or a name, of each of the lab's experiments that are compared with its truth."""
        made = sorted((Path(one).parent.name, Path(one).name) for one in self.run.lab_experiments)
        found = [
            pattern.format(sensor=sensor, name=name, reading=READINGS[name])
            for sensor, name in made
            if self.whole and name in READINGS
        ]
        root, _, path = pattern.partition("/")
        return [getattr(self.run, root)(one.partition("/")[2]) for one in found] if path else found

    def lab_records(self) -> bool:
        """Whether the lab makes recordings of planes, workspace and loading."""
        made = self.run.lab_experiments or "simulated_block" in (self.run.lab or {})
        names = ("planes", "workspace", "loading")
        return self.whole and bool(made) and all(map(self.run.sensors_of, names))

    # The simulated block.

    def tracked_steps(self) -> Callable:
        """Its tracked surface, for a job on tracked data."""
        tracked = self.run.results("simulation/tracked.npz")
        return lambda wildcards: tracked if wildcards.data == "tracked" else []

    def lab_simulates(self) -> bool:
        """Whether the lab makes it in this run."""
        return self.whole and self.run.lab is not None and "simulated_block" in self.run.lab

    def has_simulation(self) -> bool:
        """Whether the run has it."""
        return self.whole and (self.lab_simulates() or Path(self.run.raw(STEPS)).exists())

    def simulation_options(self, *names: str) -> dict:
        """Some of its options, so that the others re-run nothing."""
        return {name: self.run.config["simulation"][name] for name in names}

    def simulated_minima(self) -> list[str]:
        """Its minima, by data and then by error option."""
        found = self.run.results
        return [
            found(f"simulation/minimise-{data}-{error}.json")
            for data in SIMULATED_DATA
            for error in self.run.errors
        ]
