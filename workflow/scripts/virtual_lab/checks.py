"""Whether a configuration of the virtual lab makes sense, before anything is simulated."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from virtual_lab.obstacle import DOWN

# A point's tolerance, on the flat face of a block and elsewhere.
ON_FACE_M, ON_SURFACE_M = 1e-6, 5e-4
# Steepest place of a form that faces up. Beyond the angle the probe's handle comes near the table.
STEEPEST_PLACE_RAD, STEEPEST_RAD = np.pi / 6, np.pi / 4
# Errors that all sensors share.
OF_OBJECT = {"radius", "template_m", "declared_m"}
NEEDED = {
    "block": {"contact": ("growth", "reach_m")},
    "ball": {"contact": ("spacing_m", "table_friction"), "object": ("paint",)},
    "ear": {"contact": ("spacing_m",), "object": ("paint",)},
    "mesh": {"contact": ("spacing_m",), "object": ("paint",)},
}


def lab_problems(lab: Mapping, sensors: Mapping, source: str) -> list[str]:
    """List what makes no sense, one line each.

    Parameters
    ----------
    lab : mapping
        lab.yaml, already right by its model.
    sensors : mapping
        Specification of each sensor.
    source : str
        File named in the lines.
    """
    lines = []
    for name, spec in lab["objects"].items():
        spec = {name: lab.get(name, {}) for name in ("device", "poses")} | spec
        lines += [f"{source}: objects.{name}.{line}" for line in _object(spec, sensors)]
    for name, options in lab.get("experiments", {}).items():
        found = _experiment(name, options, lab, sensors)
        lines += [f"{source}: experiments.{name}.{line}" for line in found]
    return lines


def _object(spec: Mapping, sensors: Mapping) -> Iterator[str]:
    yield from _missing(spec)
    yield from _material(spec["material"], spec["shape"]["kind"])
    yield from _motions(spec)
    yield from _support(spec)
    for error in ("template_m", "declared_m"):
        if spec["device"].get(error) and "mirrors" in spec["object"]:
            yield f"device.{error}: expected of an object without mirrors, found mirrors"
    points = spec["object"]["points"]
    for sensor, captures in spec["recordings"].items():
        if sensor not in spec["cameras"]:
            yield f"cameras: expected one for {sensor}, found {', '.join(spec['cameras'])}"
        unknown = {str(c).split("-")[0] for c in captures} - set(points)
        if unknown:
            yield f"recordings.{sensor}: expected points of object.points, found {min(unknown)}"
        if "base" in sensors.get(sensor, {}):
            yield from _followed(sensor, spec, sensors)
    for sensor in sorted(set(spec.get("devices", {})) - set(spec["cameras"])):
        yield f"devices: expected some of {', '.join(spec['cameras'])}, found {sensor}"
    for sensor, device in spec.get("devices", {}).items():
        for error in sorted(OF_OBJECT & {name for name, size in device.items() if size}):
            yield f"devices.{sensor}.{error}: expected in device, as all sensors share it"
    for sensor, placement in spec["cameras"].items():
        yield from _placement(f"cameras.{sensor}", sensor, placement, sensors)
    shape, deepest_m = spec["shape"], spec["contact"]["deepest_m"]
    places = {f"object.points.{k}.position_m": one["position_m"] for k, one in points.items()}
    places |= {f"pressed_at.{k}": place for k, place in spec.get("pressed_at", {}).items()}
    for field, place in places.items():
        yield from point_problems(shape, place, deepest_m, field)
    for number, point in points.items():
        yield from _direction(f"object.points.{number}.direction", point.get("direction", DOWN))


def _followed(sensor: str, spec: Mapping, sensors: Mapping) -> Iterator[str]:
    """What the lab needs to record poses, and clouds."""
    base, field = sensors[sensor]["base"], f"recordings.{sensor}: expected"
    if (found := base.get("name")) not in spec["poses"]:
        yield f"{field} base.name of its file among {', '.join(spec['poses'])}, found {found}"
    if base["camera_from_base"] == "calibration":
        yield f"{field} base.camera_from_base of its file in numbers, found calibration"
    camera = spec.get("seeded_as", {}).get(sensor)
    if "cloud" in sensors[sensor] and "depth" not in sensors.get(camera, {}):
        yield f"{field} seeded_as a sensor with a depth camera, found {camera}"


def _missing(spec: Mapping) -> Iterator[str]:
    for block, keys in NEEDED[spec["shape"]["kind"]].items():
        place, field = (spec, "") if block == "object" else (spec[block], f"{block}.")
        for key in keys:
            if key not in place:
                yield f"{field}{key}: expected for a {spec['shape']['kind']}, found nothing"


def _material(material: Mapping, kind: str) -> Iterator[str]:
    if "skin" in material and kind != "block":
        yield f"material.skin: expected of a block, found of a {kind}"
    if material["law"] == "blatz_ko" and not material["poisson_ratio"] > 0:
        yield f"material.poisson_ratio: expected > 0, found {material['poisson_ratio']}"
    relaxation = material["relaxation"]
    if len(relaxation["fractions"]) != len(relaxation["times_s"]):
        found = f"{len(relaxation['fractions'])} and {len(relaxation['times_s'])}"
        yield f"material.relaxation: expected as many fractions as times, found {found}"
    if sum(relaxation["fractions"]) >= 1:
        yield f"material.relaxation.fractions: expected a sum < 1, found {relaxation['fractions']}"


def _motions(spec: Mapping) -> Iterator[str]:
    recorded = {str(capture) for captures in spec["recordings"].values() for capture in captures}
    for block in ("motions", "pressed_at"):
        for capture in sorted(set(spec.get(block, {})) - recorded):
            yield f"{block}: expected captures of recordings, found {capture}"
    motions = {"motion": spec["motion"]}
    motions |= {f"motions.{k}": spec["motion"] | own for k, own in spec.get("motions", {}).items()}
    for field, motion in motions.items():
        yield from _depths(motion, spec["contact"])
        if "hold_s" not in motion and ("frames" not in motion or "release_s" in motion):
            needing = "release_s" if "release_s" in motion else "a recording without frames"
            yield f"{field}.hold_s: expected for {needing}, found nothing"


def _support(spec: Mapping) -> Iterator[str]:
    """How the lab's block is supported, and what its description says of it."""
    kind = spec["shape"]["kind"]
    if "glued" in spec["contact"] and kind != "block":
        yield f"contact.glued: expected for shape.kind block, found for {kind}"
    if kind == "block":
        unbonded = "table_friction" in spec["contact"] and "glued" not in spec["contact"]
        expected = "resting" if unbonded else "bonded"
        found = spec["object"]["support"].get("contact", "bonded")
        if found != expected:
            why = "with" if "table_friction" in spec["contact"] else "without"
            line = f"expected {expected} {why} contact.table_friction, found {found}"
            yield f"object.support.contact: {line}"


def _direction(field: str, found: Sequence[float]) -> Iterator[str]:
    if not -found[2] > np.linalg.norm(found) * np.cos(STEEPEST_RAD):
        yield f"{field}: expected within 45 degrees of straight down, found {list(found)}"


def _depths(motion: Mapping, contact: Mapping) -> Iterator[str]:
    deepest = contact["deepest_m"]
    if motion.get("depth_m", 0) > deepest - 3 * motion.get("depth_tremor_m", 0):
        found = motion["depth_m"]
        yield f"motion.depth_m: expected less than contact.deepest_m ({deepest}), found {found}"


def _placement(field: str, sensor: str, placement: Mapping, sensors: Mapping) -> Iterator[str]:
    if sensor not in sensors:
        yield f"{field}: expected one of {', '.join(sorted(sensors))}, found {sensor}"
        return
    low, high = sensors[sensor]["range_m"]
    if not low <= placement["distance_m"] <= high:
        found = placement["distance_m"]
        yield f"{field}.distance_m: expected {low} to {high} (the sensor's range), found {found}"


def point_problems(
    shape: Mapping, point_m: NDArray, deepest_m: float, field: str = "point"
) -> Iterator[str]:
    """List why a form cannot be indented at a point to a depth, one line each.

    Parameters
    ----------
    shape : mapping
        ``shape`` block of lab.yaml.
    point_m : (3,) array
        Object frame [m].
    deepest_m : float
        Maximum depth [m].
    field : str
        Where the point is written.
    """
    point, kind = np.asarray(point_m, dtype=float), shape["kind"]
    expected, found = f"{field}: expected on the {kind}'s", f"found {point.tolist()}"
    thickness = point[2]
    if kind == "block":
        length, width, thickness = shape["size_m"]
        beside = (np.abs(point[:2]) >= [length / 2, width / 2]).any()
        if beside or abs(point[2] - thickness) > ON_FACE_M:
            yield f"{expected} top face, {found}"
    elif kind == "ball":
        thickness = shape["radius_m"]
        if np.linalg.norm(point - [0, 0, 2 * thickness]) > ON_SURFACE_M:
            yield f"{expected} top, {found}"
    else:
        # Only here: of other forms no distance is needed.
        from virtual_lab.signed_distance import distance_of, slope

        try:
            distance = distance_of(shape)
        except ValueError as error:
            yield f"shape.file: {error}"
            return
        if abs(float(distance(point[None])[0])) > ON_SURFACE_M:
            yield f"{expected} surface, {found}"
        elif slope(point[None], distance)[0, 2] < np.cos(STEEPEST_PLACE_RAD):
            yield f"{field}: expected where the {kind} faces up, {found}"
    if not deepest_m < thickness:
        line = f"expected less than {thickness} (its thickness), found {deepest_m}"
        yield f"contact.deepest_m: {line}"


def _experiment(name: str, options: Mapping, lab: Mapping, sensors: Mapping) -> Iterator[str]:
    for sensor in options["sensors"]:
        if sensor not in sensors:
            yield f"sensors: expected some of {', '.join(sorted(sensors))}, found {sensor}"
            continue
        if name == "calibration" and sensors[sensor]["kind"] != "structured_light":
            yield f"sensors: expected one with an infrared camera, found {sensor}"
        if "camera" in options:
            yield from _placement("camera", sensor, options["camera"], sensors)
        if name == "planes":
            low, high = sensors[sensor]["range_m"]
            for found in options["distances_m"].get(sensor, []):
                if not low <= found <= high:
                    yield f"distances_m.{sensor}: expected {low} to {high}, found {found}"
    if name != "loading":
        return
    if options["object"] not in lab["objects"]:
        yield f"object: expected one of {', '.join(lab['objects'])}, found {options['object']}"
        return
    spec = lab["objects"][options["object"]]
    if options["point"] not in spec["object"]["points"]:
        yield f"point: expected a point of {options['object']}, found {options['point']}"
    yield from _depths(options["motion"], spec["contact"])
