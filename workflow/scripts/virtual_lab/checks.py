"""Whether a configuration of the virtual lab makes sense, before anything is simulated."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from virtual_lab.obstacle import DOWN

ON_SURFACE_M = 5e-4
# Beyond it the probe's handle comes near the table.
STEEPEST_RAD = np.pi / 4
# Errors that are the same whoever films.
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
        spec = {"device": lab.get("device", {})} | spec
        lines += [f"{source}: objects.{name}.{line}" for line in _object(spec, sensors)]
    for name, options in lab.get("experiments", {}).items():
        found = _experiment(name, options, lab, sensors)
        lines += [f"{source}: experiments.{name}.{line}" for line in found]
    return lines


def _object(spec: Mapping, sensors: Mapping) -> Iterator[str]:
    yield from _missing(spec)
    yield from _material(spec["material"], spec["shape"]["kind"])
    yield from _motions(spec)
    yield from _standing(spec)
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
    for sensor in sorted(set(spec.get("devices", {})) - set(spec["cameras"])):
        yield f"devices: expected some of {', '.join(spec['cameras'])}, found {sensor}"
    for sensor, device in spec.get("devices", {}).items():
        for error in sorted(OF_OBJECT & {name for name, size in device.items() if size}):
            yield f"devices.{sensor}.{error}: expected in device, as all sensors share it"
    for sensor, placement in spec["cameras"].items():
        yield from _placement(f"cameras.{sensor}", sensor, placement, sensors)
    for number, point in points.items():
        yield from _point(f"object.points.{number}.position_m", spec, np.array(point["position_m"]))
        yield from _direction(f"object.points.{number}.direction", point.get("direction", DOWN))
    for capture, place in spec.get("pressed_at", {}).items():
        yield from _point(f"pressed_at.{capture}", spec, np.array(place))
    for capture, found in spec.get("pressed_along", {}).items():
        yield from _direction(f"pressed_along.{capture}", found)


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
    for block in ("motions", "pressed_at", "pressed_along"):
        for capture in sorted(set(spec.get(block, {})) - recorded):
            yield f"{block}: expected captures of recordings, found {capture}"
    yield from _depths(spec["motion"], spec["contact"])
    yield from _ends("motion", spec["motion"])
    for capture, changes in spec.get("motions", {}).items():
        motion = spec["motion"] | changes
        yield from _depths(motion, spec["contact"])
        yield from _ends(f"motions.{capture}", motion)


def _ends(field: str, motion: Mapping) -> Iterator[str]:
    if "hold_s" not in motion and ("frames" not in motion or "release_s" in motion):
        needing = "release_s" if "release_s" in motion else "a film without frames"
        yield f"{field}.hold_s: expected for {needing}, found nothing"


def _standing(spec: Mapping) -> Iterator[str]:
    """What the lab's block does on the table, and what its description says of it."""
    kind = spec["shape"]["kind"]
    if "glued" in spec["contact"] and kind != "block":
        yield f"contact.glued: expected for shape.kind block, found for {kind}"
    if kind == "block":
        loose = "table_friction" in spec["contact"] and "glued" not in spec["contact"]
        expected = "resting" if loose else "bonded"
        found = spec["object"]["support"].get("contact", "bonded")
        if found != expected:
            why = "with" if "table_friction" in spec["contact"] else "without"
            yield (
                f"object.support.contact: expected {expected} {why} contact.table_friction,"
                f" found {found}"
            )


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


def _point(field: str, spec: Mapping, point: np.ndarray) -> Iterator[str]:
    shape, deepest = spec["shape"], spec["contact"]["deepest_m"]
    place = f"{field}: expected on the {shape['kind']}'s"
    if shape["kind"] == "block":
        size = np.array(shape["size_m"])
        if (np.abs(point[:2]) >= size[:2] / 2).any() or abs(point[2] - size[2]) > ON_SURFACE_M:
            yield f"{place} top face, found {point.tolist()}"
        thickness = size[2]
    elif shape["kind"] == "ball":
        thickness = shape["radius_m"]
        if np.linalg.norm(point - [0, 0, 2 * thickness]) > ON_SURFACE_M:
            yield f"{place} top, found {point.tolist()}"
    else:
        thickness = point[2]
        try:
            off = _off_surface(shape, point)
        except ValueError as error:
            yield f"shape.file: {error}"
            return
        if off > ON_SURFACE_M:
            yield f"{place} surface, found {point.tolist()}"
    if not deepest < thickness:
        yield f"contact.deepest_m: expected less than {thickness} (its thickness), found {deepest}"


def _off_surface(shape: Mapping, point: np.ndarray) -> float:
    """Distance of a point from the surface of an ear or of a drawn mesh [m]."""
    if shape["kind"] == "ear":
        from virtual_lab.ear import ear_distance as distance
    else:
        from virtual_lab.closed_mesh import ClosedMesh

        distance = ClosedMesh(shape["file"])
    return abs(float(distance(point[None])[0]))


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
    if name == "loading":
        yield from _loading(options, lab)


def _loading(options: Mapping, lab: Mapping) -> Iterator[str]:
    if options["object"] not in lab["objects"]:
        yield f"object: expected one of {', '.join(lab['objects'])}, found {options['object']}"
        return
    spec = lab["objects"][options["object"]]
    if options["point"] not in spec["object"]["points"]:
        yield f"point: expected a point of {options['object']}, found {options['point']}"
    yield from _depths(options["motion"], spec["contact"])
