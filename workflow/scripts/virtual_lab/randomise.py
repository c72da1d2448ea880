"""Randomised labs: objects, indentations and rigs drawn from declared ranges.

    python -m virtual_lab.randomise config/validation.yaml validation/1 --seed 1

writes ``validation/1/lab.yaml``, the sensors' files and ``config.yaml``, a run of it. With
``--alone`` instead a block, a ball and a randomised object, each recorded once for each rig error.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import yaml
from palpate.capture.files import write_text
from palpate.config.model import problems
from palpate.yaml_files import load_yaml

from virtual_lab.checks import OF_OBJECT
from virtual_lab.specification import Ranges

# Draws of a depth and a modulus until they make a force that an operator applies.
ATTEMPTS = 1000
# Of the contact solution, by the radius of the contact at the maximum depth.
ELEMENTS_A_CONTACT, ELEMENT_M = 4.0, (0.0005, 0.0014)
CONTACTS_A_REACH, REACH_M = 4.0, (0.006, 0.020)
STEPS, STEP_M = 14, (0.0001, 0.0005)
# The lobe is thin.
EAR_DEEPEST_M = 0.0045
# An operator's depth is a little less than intended; so far goes the contact solution beyond. The
# indentation table goes farther: what a rig has wrong about the depth must stay within it.
BEYOND_M, BEYOND = 0.0002, 1.03
FINE_M, TABLE_BEYOND_M = 0.0005, 0.0012
DIGITS = 4
APART = ("like", "experiments", "simulated_block")
SENSORS = ("bumblebee", "kinect")
# Templates of blocks have about so many vertices an area [1/m2], as those of lab.yaml.
VERTICES_A_M2 = 6500
# Largest seed that a configuration takes.
LARGEST_SEED = 2**53 - 1
# Errors that a stereo head has not; objects of lab.yaml, and points of them, for errors alone.
OF_DEPTH = ("color_from_depth_deg", "color_from_depth_m", "depth_delay_s")
ALONE = {"block": ("foam_block", "08"), "ball": ("foam_ball", "01")}


def random_lab(ranges: Mapping, base: Mapping, probe: Mapping, *, seed: int) -> dict:
    """Draw a lab from ranges: the content of its file.

    Parameters
    ----------
    ranges : mapping
        config/validation.yaml.
    base : mapping
        config/lab.yaml: noise, light, motion, and how a ball and an ear look and are scanned.
    probe : mapping
        The probe's file.
    seed : int

    Raises
    ------
    ValueError
        If no indentation in these ranges has a force in theirs.
    """
    lab = {key: value for key, value in base.items() if key not in APART}
    lab |= {name: ranges[name] for name in ("background_frames", "device")} | {"seed": seed}
    objects = {}
    for k in range(ranges["objects"]):
        rng = np.random.default_rng([seed, k])
        objects[f"object_{k + 1:02d}"] = _object(ranges, base["objects"], probe, rng)
    return lab | {"objects": objects}


def single_errors(
    ranges: Mapping, base: Mapping, probe: Mapping, *, seed: int
) -> tuple[dict, dict[str, str]]:
    """Draw a lab with each rig error by itself, at twice its size.

    Each error is a sensor of its name with a device of its own, so that all recordings of an object
    share its mechanics and its indentation table, and all but their errors. What belongs to the
    object, the sphere's radius among it, is left out. Errors are random in their sign alone.

    Parameters
    ----------
    ranges, base, probe, seed
        As for `random_lab`.

    Returns
    -------
    dict
        Content of a lab's file.
    dict
        Sensor, by the name of an error, to that whose file it is.
    """
    sizes = {k: size for k, size in ranges["device"].items() if k not in OF_OBJECT}
    signs = {"signs_alone": True}
    devices = {"nominal": {}, "all_errors": sizes | signs}
    devices |= {name: {name: 2 * size} | signs for name, size in sizes.items()}
    like = {name: "kinect" if name in OF_DEPTH else "bumblebee" for name in devices}
    like |= {"kinect_nominal": "kinect", "kinect_all_errors": "kinect"}
    devices |= {f"kinect_{name}": devices[name] for name in ("nominal", "all_errors")}
    lab = random_lab(ranges | {"objects": 1}, base, probe, seed=seed)
    chosen = {name: (base["objects"][theirs], point) for name, (theirs, point) in ALONE.items()}
    objects = {}
    chosen |= {name: (spec, "01") for name, spec in lab["objects"].items()}
    for name, (spec, point) in chosen.items():
        objects[name] = {key: value for key, value in spec.items() if key != "rig"} | {
            "devices": devices,
            "seeded_as": like,
            "cameras": {error: spec["cameras"][sensor] for error, sensor in like.items()},
            "recordings": {error: [point] for error in like},
        }
    return lab | {"objects": objects, "device": {}}, like


def _object(ranges: Mapping, like: Mapping, probe: Mapping, rng: np.random.Generator) -> dict:
    radius_m = probe["indenter"]["radius_m"]
    kind = _one_of({name: form["weight"] for name, form in ranges["forms"].items()}, rng)
    shape, point_m = _shape(kind, ranges["forms"][kind], like["ear"], rng)
    deepest_m = min(0.4 * point_m[2], EAR_DEEPEST_M if kind == "ear" else np.inf)
    E, nu, depth_m = _indentation(ranges, radius_m, deepest_m, rng)
    unbonded = kind == "ball" or (kind == "block" and rng.uniform() < ranges["loose"])
    model = like[{"block": "foam_block", "ball": "foam_ball", "ear": "ear"}[kind]]
    press, material = ranges["press"], ranges["material"]
    ends_m = depth_m * BEYOND + BEYOND_M
    relaxed = [_within(material["relaxation_fraction"], rng) for _ in range(2)]
    captures = ["01", *(f"01-a{k:02d}" for k in range(1, ranges["captures"]))]
    spec = {
        "rig": f"rig_{rng.integers(10**6):06d}",
        "shape": shape,
        "material": {
            "law": _one_of(material["law"], rng),
            "youngs_modulus_pa": E,
            "poisson_ratio": nu,
            "relaxation": {
                "fractions": relaxed,
                "times_s": [_within(ends, rng) for ends in material["relaxation_times_s"]],
            },
        },
        "contact": _contact(kind, ends_m, radius_m)
        | ({"table_friction": _within(ranges["table_friction"], rng)} if unbonded else {}),
        "motion": {key: value for key, value in model["motion"].items() if key != "frames"}
        | {
            "depth_m": depth_m,
            "hold_s": _within(press["hold_s"], rng),
            "tilt_deg": _within(press["tilt_deg"], rng),
            "contact_tremor_m": press["contact_tremor_m"],
        },
        "cameras": {name: _placement(ranges["stand"], name, model, rng) for name in SENSORS},
        "scan": model["scan"],
        "recordings": {name: captures for name in SENSORS if name in model["recordings"]},
        "object": _description(kind, shape, point_m, ends_m, model, unbonded=unbonded),
    }
    if kind != "block":
        spec["paint"] = model["paint"] | {
            "gloss": _within(ranges["gloss"], rng),
            "colour": [_within((0.2, 0.65), rng) for _ in range(3)],
        }
    spec["contact"]["friction"] = _within(ranges["sphere_friction"], rng)
    return spec


def _shape(
    kind: str, form: Mapping, ear: Mapping, rng: np.random.Generator
) -> tuple[dict, list[float]]:
    """Form, and the point that is indented [m]."""
    if kind == "block":
        size = [_within(ends, rng) for ends in form["size_m"]]
        return {"kind": kind, "size_m": size}, [0.0, 0.0, size[2]]
    if kind == "ball":
        R = _within(form["radius_m"], rng)
        return {"kind": kind, "radius_m": R}, [0.0, 0.0, 2 * R]
    return {"kind": kind}, ear["object"]["points"]["01"]["position_m"]


def _indentation(
    ranges: Mapping, radius_m: float, deepest_m: float, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Young's modulus [Pa], Poisson's ratio and depth [m] whose force by Hertz is in its range."""
    material, press = ranges["material"], ranges["press"]
    low, high = press["force_n"]
    nu = _within(material["poisson_ratio"], rng)
    for _ in range(ATTEMPTS):
        E = float(np.exp(rng.uniform(*np.log(material["youngs_modulus_pa"]))))
        depth_m = radius_m * rng.uniform(*press["depth_over_radius"])
        force_n = 4 / 3 * E / (1 - nu**2) * np.sqrt(radius_m) * depth_m**1.5
        if low <= force_n <= high and depth_m <= deepest_m:
            return _rounded(E), nu, _rounded(depth_m)
    raise ValueError(
        f"press: expected depths up to {deepest_m:.4g} m with forces of {low} to {high} N,"
        f" found none in {ATTEMPTS} draws"
    )


def _contact(kind: str, ends_m: float, radius_m: float) -> dict:
    contact_m = np.sqrt(radius_m * ends_m)
    found = {
        "step_m": _rounded(np.clip(ends_m / STEPS, *STEP_M)),
        "deepest_m": _rounded(ends_m),
        "element_m": _rounded(np.clip(contact_m / ELEMENTS_A_CONTACT, *ELEMENT_M)),
    }
    if kind == "block":
        reach_m = np.clip(CONTACTS_A_REACH * contact_m, *REACH_M)
        found |= {"growth": 1.7, "reach_m": _rounded(reach_m), "straight": True}
    else:
        found |= {"spacing_m": 0.008 if kind == "ball" else 0.004}
        found["element_m"] = min(found["element_m"], 0.001 if kind == "ball" else 0.0007)
    return found


def _placement(stand: Mapping, sensor: str, model: Mapping, rng: np.random.Generator) -> dict:
    like = model["cameras"].get(sensor, model["cameras"][SENSORS[0]])
    return dict(like) | {
        "distance_m": _within(stand["distance_m"][sensor], rng),
        "elevation_deg": _within(stand["elevation_deg"], rng),
    }


def _description(
    kind: str, shape: Mapping, point_m: Sequence, ends_m: float, model: Mapping, *, unbonded: bool
) -> dict:
    """Block ``object`` of a lab's object, of which object.yaml is written."""
    template = model["object"]["template"]
    if kind == "block":
        a, b, c = shape["size_m"]
        template = {"vertices": round(VERTICES_A_M2 * 2 * (a * b + b * c + c * a))}
    support = model["object"]["support"] | {"contact": "resting" if unbonded else "bonded"}
    return {
        "probe": model["object"]["probe"],
        "template": template,
        "support": support,
        "deepest_m": _rounded(FINE_M * np.ceil((ends_m + TABLE_BEYOND_M) / FINE_M)),
        "points": {"01": {"position_m": list(point_m)}},
    }


def _within(ends: Sequence[float], rng: np.random.Generator) -> float:
    return _rounded(rng.uniform(*ends))


def _one_of(weights: Mapping[str, float], rng: np.random.Generator) -> str:
    shares = np.array(list(weights.values()), dtype=float)
    return str(rng.choice(list(weights), p=shares / shares.sum()))


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def write_run(
    folder: Path, lab: Mapping, sensors: Mapping[str, Mapping], direct: Mapping, *, seed: int
) -> None:
    """Write a randomised lab, its sensors' files by name, and a configuration of a run of it."""
    places = {name: f"{folder}/{name}" for name in ("raw", "results", "sensors")}
    paths = places | {"lab": f"{folder}/lab.yaml"}
    config = {"paths": paths, "seed": seed, "direct": dict(direct)}
    files = {"lab": lab}
    for name, spec in sensors.items():
        # Nobody calibrates each of so many cameras, or knows how far their clocks are off.
        stated = {k: v for k, v in spec.items() if k != "clock_offset_std_s"}
        files[f"sensors/{name}"] = stated | {"sensor": name, "optics": "stated"}
    # A run begins with the configuration: it comes when all that it names is there.
    for name, content in (files | {"config": config}).items():
        # What two objects share is written twice, not as an anchor.
        plain = json.loads(json.dumps(content))
        write_text(folder / f"{name}.yaml", yaml.safe_dump(plain, sort_keys=False))


def direct_of(ranges: Mapping, probe: Mapping) -> dict:
    """Options ``direct`` of a run, with standard deviations of such a rig's errors."""
    device, given = ranges["device"], ranges.get("direct", {})
    rig = {
        "force_scale_std": device["force_gain"],
        "force_drift_std_n": device["force_drift_n"],
        "radius_std_m": _rounded(device["radius"] * probe["indenter"]["radius_m"]),
    }
    return dict(given) | {"fit": dict(given.get("fit", {})) | {"rig": rig}}


def read_ranges(path: Path) -> dict:
    """Read the ranges that a lab is drawn from.

    Raises
    ------
    ValueError
        If there is no such file, or anything in it makes no sense: one line for each.
    """
    ranges = load_yaml(path)
    if lines := problems(Ranges, ranges, str(path)):
        raise ValueError("\nerror: ".join(lines))
    return Ranges.plain(ranges)


def _write(given: argparse.Namespace) -> None:
    if not 0 <= given.seed <= LARGEST_SEED:
        raise ValueError(f"--seed: expected 0 to {LARGEST_SEED}, found {given.seed}")
    if not given.folder.name:
        raise ValueError(f"folder: expected one of its own, found '{given.folder}'")
    ranges, base = read_ranges(given.ranges), load_yaml("config/lab.yaml")
    probe = load_yaml("config/probes/nano25_sphere.yaml")
    like = {name: name for name in SENSORS}
    if given.alone:
        lab, like = single_errors(ranges, base, probe, seed=given.seed)
    else:
        lab = random_lab(ranges, base, probe, seed=given.seed)
    sensors = {name: load_yaml(f"config/sensors/{file}.yaml") for name, file in like.items()}
    write_run(given.folder, lab, sensors, direct_of(ranges, probe), seed=given.seed)


def main(argv: Sequence[str] | None = None) -> None:
    """Write a randomised lab into a folder."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0], allow_abbrev=False)
    parser.add_argument("ranges", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--alone", action="store_true", help="each error by itself")
    given = parser.parse_args(argv)
    try:
        _write(given)
    except (ValueError, OSError) as error:
        parser.exit(1, f"error: {error}\n")


if __name__ == "__main__":
    main()
