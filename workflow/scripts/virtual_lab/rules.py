"""What the virtual lab's rules take from a run's configuration."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Of lab.yaml: what no recording needs.
APART = ("objects", "experiments", "simulated_block", "laser", "poses")
# Of an object's block: what its form, its looks and its description do not depend on.
RECORDED = ("recordings", "scan", "motions", "seeded_as", "pressed_at", "devices")


@dataclass(frozen=True)
class LabRules:
    """Inputs and params of the lab's rules, of a run.

    Attributes
    ----------
    run
        The workflow's `palpate.workflow.run.Run`.
    """

    run: Any

    @property
    def modelled(self) -> list[str]:
        """Objects that the lab can indent, even those whose names people dropped recordings of."""
        return sorted(self.run.lab["objects"]) if self.run.lab else []

    @property
    def templates(self) -> list[str]:
        """Objects whose templates the lab writes itself."""
        return sorted(set(self.run.lab_objects) - set(self.run.scanned))

    @property
    def simulates(self) -> bool:
        """Whether it makes the simulated block."""
        return bool(self.run.lab) and "simulated_block" in self.run.lab

    def outputs(self) -> list[str]:
        """Everything that the lab writes into raw/."""
        run, made = self.run, self.run.simulated
        captures = {run.raw(f"{c.object}/{c.sensor}/{c.capture}") for c in made}
        backgrounds = {run.raw(f"{c.object}/{c.sensor}/background") for c in made}
        objects = {run.raw(f"{c.object}/object.yaml") for c in made}
        scans = {run.raw(f"{c.object}/scans") for c in made}
        objects |= {run.raw(f"{name}/template.ply") for name in self.templates}
        return sorted(captures | backgrounds | objects | scans) + self.experiments()

    def experiments(self) -> list[str]:
        """Recordings about the sensors and simulations, where the lab is to make them."""
        run = self.run
        if run.lab is None or run.config["only"] is not None:
            return []
        recordings = [run.raw(f"sensors/{name}") for name in sorted(run.lab_experiments)]
        return recordings + [run.raw("simulations/foam_block.npz")] * self.simulates

    def spec(self, wildcards: Any) -> Mapping:
        """An object's block of lab.yaml but for what is recorded of it, with a sensor's errors."""
        spec = self.run.lab["objects"][wildcards.object]
        device = spec.get("devices", {}).get(getattr(wildcards, "sensor", None))
        own = {} if device is None else {"device": device}
        return {k: v for k, v in spec.items() if k not in RECORDED} | own

    def sensor(self, wildcards: Any) -> Mapping:
        """A sensor's file, under the name that what is drawn of it goes by.

        Of clouds that one's file, which has the camera; with a base, how it follows the probe.
        """
        seeded = self.run.lab["objects"][wildcards.object].get("seeded_as", {})
        spec, name = self.run.sensor_spec(wildcards), seeded.get(wildcards.sensor, wildcards.sensor)
        if "cloud" in spec:
            spec = self.run.sensors[name] | {key: spec[key] for key in ("cloud", "base")}
        if "base" in spec:
            spec = spec | {"base": self.run.lab["poses"][spec["base"]["name"]] | spec["base"]}
        return spec | {"sensor": name}

    def recorded(self, wildcards: Any) -> Mapping:
        """An object's block of lab.yaml with a capture's own motion."""
        spec = self.spec(wildcards)
        own = self.run.lab["objects"][wildcards.object].get("motions", {})
        return spec | {"motion": spec["motion"] | own.get(wildcards.capture, {})}

    def place(self, wildcards: Any) -> Mapping:
        """Where the operator indents for a capture, and in which direction."""
        places, capture = self._places(wildcards.object), wildcards.capture
        return places.get(capture) or places[capture.split("-")[0]]

    def _places(self, name: str) -> dict[str, Mapping]:
        """An object's points, and by capture what the operator indents otherwise than declared."""
        spec = self.run.lab["objects"][name]
        points = spec["object"]["points"]
        return points | {
            capture: points[capture.split("-")[0]] | {"position_m": place}
            for capture, place in spec.get("pressed_at", {}).items()
        }

    def common(self, wildcards: Any) -> Mapping:
        """What all recordings of the lab share."""
        return {k: v for k, v in self.run.lab.items() if k not in APART}

    def shape(self, wildcards: Any) -> Mapping:
        """An object's shape."""
        return self.run.lab["objects"][wildcards.object]["shape"]

    def form(self, wildcards: Any) -> str | list:
        """File of the mesh that is an object's form, if one is."""
        return self.shape(wildcards).get("file", [])

    def laser(self, wildcards: Any) -> Mapping:
        """The laser scanner, its views of an object, and the seed."""
        scan = self.run.lab["objects"][wildcards.object]["scan"]
        return self.run.lab["laser"] | scan | {"seed": self.run.lab["seed"]}

    def probe(self, wildcards: Any) -> Mapping:
        """Probe with which the lab indents one of its objects."""
        return self.run.probes[self.run.lab["objects"][wildcards.object]["object"]["probe"]]

    def mechanics(self, wildcards: Any) -> Mapping:
        """What the mechanics of an object depend on."""
        spec = self.spec(wildcards)
        parts = {key: spec[key] for key in ("shape", "material", "contact")}
        return parts | self._errors(spec, "radius") | {"points": self._places(wildcards.object)}

    def written(self, wildcards: Any) -> Mapping:
        """What the errors depend on that people make who describe an object."""
        return self._errors(self.spec(wildcards), "template_m", "declared_m")

    def _errors(self, spec: Mapping, *names: str) -> dict:
        """Some rig errors of an object, with what they are drawn from; nothing without any."""
        device = spec.get("device", self.run.lab.get("device", {}))
        found = {name: device[name] for name in names if device.get(name)}
        rig = {key: spec[key] for key in ("rig",) if key in spec}
        return {"seed": self.run.lab["seed"], "device": found} | rig if found else {}

    def load_steps(self, wildcards: Any) -> str:
        """Mechanics of a capture's point; mirror images of a symmetric object share one."""
        name, point = wildcards.object, wildcards.capture
        spec = self.run.lab["objects"][name]
        if point not in spec.get("pressed_at", {}):
            point = self.run.lab_point(name, point.split("-")[0])
        return self.run.truth(f"{wildcards.object}/contact-{point}.npz")

    def experiment(self, wildcards: Any) -> Mapping:
        """An experiment's block of lab.yaml, with the object's where it indents one."""
        options = self.run.lab["experiments"][Path(wildcards.recording).name]
        if "object" not in options:
            return options
        return options | {"spec": self.run.lab["objects"][options["object"]]}

    def experiment_sensor(self, wildcards: Any) -> Mapping:
        """Sensor of an experiment."""
        return self.run.sensors[Path(wildcards.recording).parent.name]

    def experiment_probe(self, wildcards: Any) -> Mapping | None:
        """Probe of an experiment, if it has one."""
        options = self.experiment(wildcards)
        if "spec" in options:
            return self.run.probes[options["spec"]["object"]["probe"]]
        return self.run.probes[options["probe"]] if "probe" in options else None

    def experiment_load_steps(self, wildcards: Any) -> str | list:
        """Mechanics of the point that an experiment indents, if it does."""
        options = self.experiment(wildcards)
        if "spec" not in options:
            return []
        point = self.run.lab_point(options["object"], options["point"])
        return self.run.truth(f"{options['object']}/contact-{point}.npz")
