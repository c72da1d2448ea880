"""Numbers that a model takes: other units, other clocks, other captures, other probes."""

import numpy as np
import pandas as pd
import trimesh

from spoilt.place import GAUGES, ROOT, WRENCH, Mutation, Place

SAMPLE = ROOT / "tests/sample/raw/foam_block"


def _force(change):
    return lambda place: place.csv(place.capture / "force.csv", change)


def _frames(change):
    return lambda place: place.csv(place.capture / "frames.csv", change)


def _scaled(columns, factor):
    def change(table: pd.DataFrame) -> None:
        table[columns] = table[columns] * factor

    return _force(change)


def _times(factor=1.0, shift=0.0, *, force=True, frames=True):
    def spoil(place: Place) -> None:
        for name, wanted in (("force.csv", force), ("frames.csv", frames)):
            if wanted:
                place.csv(
                    place.capture / name, lambda t: t.assign(time_s=t["time_s"] * factor + shift)
                )

    return spoil


def _jump(name: str, after_s: float, jump_s: float):
    def spoil(place: Place) -> None:
        place.csv(
            place.capture / name,
            lambda t: t.assign(time_s=t["time_s"] + jump_s * (t["time_s"] > after_s)),
        )

    return spoil


def _yaml(path: str, *keys, factor=None, value=None):
    def spoil(place: Place) -> None:
        def change(spec: dict) -> None:
            part = spec
            for key in keys[:-1]:
                part = part[key]
            old = part[keys[-1]]
            new = np.multiply(old, factor).tolist() if factor is not None else value
            part[keys[-1]] = new

        file = place.object / path if path == "object.yaml" else place.folder / path
        place.yaml(file, change)

    return spoil


def _template(change):
    def spoil(place: Place) -> None:
        mesh = trimesh.load(place.object / "template.ply", process=False)
        place.write(place.object / "template.ply", change(mesh).export(file_type="ply"))

    return spoil


def _moved(factor=1.0, shift=(0, 0, 0)):
    def change(mesh):
        mesh.vertices = mesh.vertices * factor + shift
        return mesh

    return _template(change)


def _of_bumblebee(name):
    def spoil(place: Place) -> None:
        place.write(place.capture / name, (SAMPLE / "bumblebee/08" / name).read_bytes())

    return spoil


def _reversed_force(table):
    values = table.drop(columns="time_s").to_numpy()[::-1]
    table[table.columns.drop("time_s")] = values


def _swapped(table):
    table[["fx_n", "fz_n"]] = table[["fz_n", "fx_n"]].to_numpy()


THRESHOLD = ("marker", "reprojection_threshold_px")
PROBE, SENSOR = "probes/nano25_sphere.yaml", "sensors/kinect.yaml"
SMALL = "a factor this near to 1 fits the depth and the declared point; weigh the probe to see it"


def corpus() -> list[Mutation]:
    """Mutations of physics."""
    return _forces() + _clocks() + _lengths() + _optics()


def _forces() -> list[Mutation]:
    every, forces, torques = WRENCH, WRENCH[:3], WRENCH[3:]
    cases = [
        ("wrench in mN and mNm", _scaled(every, 1e3), ""),
        ("force in mN, torque in Nm", _scaled(forces, 1e3), ""),
        ("torque in mNm", _scaled(torques, 1e3), ""),
        ("wrench in kN", _scaled(every, 1e-3), ""),
        ("force in kilogram-force", _scaled(every, 1 / 9.81), SMALL),
        ("force in pound-force", _scaled(every, 1 / 4.448), SMALL),
        ("force in grams", _scaled(every, 1e3 / 9.81), ""),
        ("force in cN", _scaled(every, 100.0), SMALL),
        ("force in dyn", _scaled(every, 1e5), ""),
        ("sign flipped", _scaled(every, -1.0), ""),
        ("sign of fz flipped", _scaled(["fz_n"], -1.0), ""),
        ("fx and fz exchanged", _force(_swapped), ""),
        ("force of 1e200", _scaled(every, 1e200), ""),
        ("force all zero", _scaled(every, 0.0), ""),
        ("record reversed", _force(_reversed_force), ""),
        ("no unloaded beginning", _force(lambda t: t.assign(time_s=t["time_s"] - 1.2)), ""),
    ]
    found = [
        Mutation("physics", name, "force.csv", change, volts=False, told=told)
        for name, change, told in cases
    ]

    def noise(table):
        values = np.random.default_rng(2).normal(size=(len(table), 6))
        table[GAUGES] = values

    gauge = "a gauge's factor is part of the calibration: a known weight on the probe shows it"
    volts = [
        ("volts in mV", _scaled(GAUGES, 1e3)),
        ("volts in kV", _scaled(GAUGES, 1e-3)),
        ("gauges reversed", _force(lambda t: t.set_axis(["time_s", *GAUGES[::-1]], axis=1))),
        ("a gauge dead", _scaled(["v2"], 0.0)),
        ("a gauge stuck from the middle", _force(_stuck)),
        ("a gauge saturated", _force(lambda t: t.assign(v1=(t["v1"] * 5e4).clip(-10, 10)))),
        ("a gauge amplified fifty-fold", _scaled(["v1"], 50.0)),
        ("noise for force", _force(noise)),
        ("sign of volts flipped", _scaled(GAUGES, -1.0)),
        ("force of the other sensor's capture", _of_bumblebee("force.csv")),
        ("frames of the other sensor's capture", _of_bumblebee("frames.csv")),
    ]
    told = {"a gauge amplified fifty-fold": gauge}
    return found + [
        Mutation("physics", name, "force.csv", change, told=told.get(name, ""))
        for name, change in volts
    ]


def _stuck(table):
    table.loc[1500:, "v3"] = table.loc[1500, "v3"]


def _clocks() -> list[Mutation]:
    near = "within what two clocks may be apart; the press itself corrects it"
    drift = "a press at another pace looks like one of another depth to a clock that runs fast"
    slow = "at three frames a second nothing shows a quarter of a second: the contact is elsewhere"
    told = {
        "force +0.02 s late": near,
        "force at 1.1 speed": drift,
        **{f"force {s:+g} s late": slow for s in (0.1, 0.2, -0.2, 0.25, -0.25)},
    }
    cases = [
        ("both clocks in ms", _times(1e3)),
        ("both clocks in us", _times(1e6)),
        ("both clocks in minutes", _times(1 / 60)),
        ("force in ms", _times(1e3, frames=False)),
        ("frames in ms", _times(1e3, force=False)),
        ("frames in us", _times(1e6, force=False)),
        ("both since 1970", _times(1.0, 1.7e9)),
        ("both in ns since 1970", _times(1e9, 1.7e18)),
        ("both before zero", _times(1.0, -500.0)),
        ("times of 1e300", _times(1e300)),
        ("both at half speed", _times(2.0)),
        ("force at 1.1 speed", _times(1.1, frames=False)),
        *((f"force {s:+g} s late", _times(1.0, s, frames=False)) for s in (0.02, 0.1, 0.2, -0.2)),
        *((f"force {s:+g} s late", _times(1.0, s, frames=False)) for s in (0.25, -0.25, -0.5, 30)),
        *(
            (f"{name} jumps {jump:+g} s after {after:g} s", _jump(name, after, jump))
            for name in ("force.csv", "frames.csv")
            for after, jump in ((1.0, 5.0), (1.5, 0.2), (2.0, 3600), (1.0, -0.5), (1.8, 0.02))
        ),
    ]
    return [Mutation("physics", name, "time_s", change, told=told.get(name, ""))
            for name, change in cases]  # fmt: skip


def _lengths() -> list[Mutation]:
    template = ("template", "unit")
    cases = [
        ("template in mm said to be m", "template.ply", _moved(1e3)),
        ("template in m said to be mm", "object.yaml", _yaml("object.yaml", *template, value="mm")),
        *((f"template x {f:g}", "template.ply", _moved(f)) for f in (0.5, 0.8, 1.25, 2, 25.4)),
        ("template shifted by 0.1 m", "template.ply", _moved(1, (0.1, 0, 0))),
        ("template lifted by 0.02 m", "template.ply", _moved(1, (0, 0, 0.02))),
        ("template mirrored", "template.ply", _moved([1, -1, 1])),
        ("template upside down", "template.ply", _moved([1, -1, -1])),
        ("template lying on its side", "template.ply", _template(_on_its_side)),
        ("point in mm", "object.yaml", _point(1e3)),
        ("point in cm", "object.yaml", _point(100.0)),
        ("point of the far corner", "object.yaml", _at([0.25, 0.05, 0.0475])),
        ("point of the next column", "object.yaml", _at([-0.15, 0.0, 0.0475])),
        ("point of the next row", "object.yaml", _at([-0.05, 0.05, 0.0475])),
        ("point below the object", "object.yaml", _at([-0.05, 0.0, 0.0])),
        ("point inside the object", "object.yaml", _at([-0.05, 0.0, 0.02])),
        ("plane's normal down", "object.yaml", _plane("plane_normal", [0, 0, -1])),
        ("plane's normal aside", "object.yaml", _plane("plane_normal", [1, 0, 0])),
        ("plane's normal in thousands", "object.yaml", _plane("plane_normal", [0, 0, 1000])),
        ("plane's normal tiny", "object.yaml", _plane("plane_normal", [0, 0, 1e-320])),
        ("plane's normal huge", "object.yaml", _plane("plane_normal", [1e200, 0, 1e200])),
        ("plane 10 mm low", "object.yaml", _plane("plane_point_m", [0, 0, -0.01])),
        ("plane in mm", "object.yaml", _plane("plane_point_m", [0, 0, 47.5])),
        ("tolerance in mm", "object.yaml", _plane("tolerance_m", 1.0)),
        ("tolerance of 1e-12 m", "object.yaml", _plane("tolerance_m", 1e-12)),
    ]
    for key in (("marker", "square_m"), ("indenter", "radius_m")):
        for factor in (1e3, 1e-3, 0.1, 0.5, 0.9, 1.1, 2.0):
            name = f"{key[1]} x {factor:g}"
            cases.append((name, PROBE, _yaml(PROBE, *key, factor=factor)))
    for key in ("marker_from_force", "force_from_tip"):
        for row in range(3):
            cases.append((f"{key}: shift {row} in mm", PROBE, _shift(key, row, 1e3)))
            cases.append((f"{key}: shift {row} flipped", PROBE, _shift(key, row, -1)))
        cases.append((f"{key}: turned over", PROBE, _turned(key)))
    cases += [
        ("tip's shift 20 mm short", PROBE, _set(PROBE, 0.04, "force_from_tip", 2, 3)),
        ("board's corners exchanged", PROBE, _set(PROBE, [3, 4], "marker", "inner_corners")),
        ("another board", PROBE, _set(PROBE, [6, 5], "marker", "inner_corners")),
        ("load in grams", PROBE, _set(PROBE, 30.0, "load", "mass_kg")),
        ("load's centre in mm", PROBE, _set(PROBE, [0, 0, 35.0], "load", "centre_of_mass_m")),
        ("load of 0.3 kg", PROBE, _set(PROBE, 0.3, "load", "mass_kg")),
        ("gauges in mN", PROBE, _yaml(PROBE, "gauge", "calibration", factor=1e3)),
        ("gauges in kN", PROBE, _yaml(PROBE, "gauge", "calibration", factor=1e-3)),
        ("gauges transposed", PROBE, _transposed),
        ("gauges all zero", PROBE, _yaml(PROBE, "gauge", "calibration", factor=0)),
        ("gauge's range 0.01 V", PROBE, _set(PROBE, 0.01, "gauge", "range_v")),
    ]
    near = "E follows the root of the radius: nothing else in a capture shows the sphere"
    told = {"radius_m x 0.9": near, "radius_m x 1.1": near}
    return [Mutation("physics", n, f, c, told=told.get(n, "")) for n, f, c in cases]


def _on_its_side(mesh):
    mesh.vertices = mesh.vertices[:, [0, 2, 1]]
    mesh.invert()
    return mesh


def _set(path, value, *keys):
    return _yaml(path, *keys, value=value)


def _point(factor):
    return _yaml("object.yaml", "points", "08", "position_m", factor=factor)


def _at(place):
    return _yaml("object.yaml", "points", "08", "position_m", value=place)


def _plane(key, value):
    return _yaml("object.yaml", "support", key, value=value)


def _shift(key, row, factor):
    return _yaml(PROBE, key, row, 3, factor=factor)


def _turned(key):
    def spoil(place: Place) -> None:
        def change(spec: dict) -> None:
            rows = np.array(spec[key]) @ np.diag([1.0, -1, -1, 1])
            spec[key] = rows.tolist()

        place.yaml(place.folder / PROBE, change)

    return spoil


def _transposed(place: Place) -> None:
    def change(spec: dict) -> None:
        spec["gauge"]["calibration"] = np.array(spec["gauge"]["calibration"]).T.tolist()

    place.yaml(place.folder / PROBE, change)


def _optics() -> list[Mutation]:
    cases = []
    for part, key in (("color", "fx_px"), ("color", "fy_px"), ("color", "cx_px"),
                      ("depth", "fx_px"), ("depth", "cy_px"), ("depth", "baseline_m"),
                      ("depth", "disparity_scale"), ("depth", "disparity_offset_px")):  # fmt: skip
        for factor in (1e3, 0.5, 1.1, -1.0):
            cases.append((f"{part}.{key} x {factor:g}", _yaml(SENSOR, part, key, factor=factor)))
    cases += [
        ("range in mm", _yaml(SENSOR, "range_m", factor=1e3)),
        ("range too near", _yaml(SENSOR, "range_m", value=[0.1, 0.3])),
        ("range too far", _yaml(SENSOR, "range_m", value=[3.0, 8.0])),
        ("depth said to be millimetre", _yaml(SENSOR, "depth", "encoding", value="millimetre")),
        ("mosaic said to be grey", _yaml(SENSOR, "color", "encoding", value="mono8")),
        ("mosaic said to be colour", _yaml(SENSOR, "color", "encoding", value="rgb8")),
        ("no_reading of 0", _yaml(SENSOR, "depth", "no_reading", value=0)),
        ("depth camera where colour is", _identity),
        ("depth camera 1 m off", _yaml(SENSOR, "depth", "color_from_depth", 0, 3, value=-1.0)),
        ("depth camera in mm", _yaml(SENSOR, "depth", "color_from_depth", 0, 3, value=-25.0)),
        ("frame rate of 1e6", _yaml(SENSOR, "frame_rate_hz", value=1e6)),
        ("distortion of 1e6", _yaml(SENSOR, "color", "distortion", value=[1e6, 0, 0, 0, 0])),
        ("distortion of 0.3", _yaml(SENSOR, "color", "distortion", value=[0.3, 0, 0, 0, 0])),
        ("threshold of 1e-9 px", _yaml(SENSOR, *THRESHOLD, value=1e-9)),
        ("threshold of 1e9 px", _yaml(SENSOR, *THRESHOLD, value=1e9)),
        ("said to be a stereo head", _yaml(SENSOR, "kind", value="stereo")),
    ]  # fmt: skip
    return [Mutation("physics", name, SENSOR, change) for name, change in cases]


def _identity(place: Place) -> None:
    rows = np.eye(4).tolist()
    _yaml(SENSOR, "depth", "color_from_depth", value=rows)(place)
