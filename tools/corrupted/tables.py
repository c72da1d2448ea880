"""Entries of tables: frames.csv and force.csv of captures, and curves."""

import numpy as np

from corrupted import edits as to
from corrupted.places import BLOCK, COW

GAUGES = [f"v{k}" for k in range(6)]
FORCES, TORQUES = ["fx_n", "fy_n", "fz_n"], ["tx_nm", "ty_nm", "tz_nm"]
WRENCH = FORCES + TORQUES
# How a table is written.
WRITTEN = {
    "BOM": to.content(lambda c: b"\xef\xbb\xbf" + c),
    "CRLF": to.content(lambda c: c.replace(b"\n", b"\r\n")),
    "semicolons": to.content(lambda c: c.replace(b",", b";")),
    "decimal commas": to.content(lambda c: c.replace(b",", b";").replace(b".", b",")),
    "UTF-16": to.content(lambda c: c.decode().encode("utf-16")),
    "no header": to.content(lambda c: c.split(b"\n", 1)[1]),
    "header twice": to.content(lambda c: c.split(b"\n", 1)[0] + b"\n" + c),
    "zero bytes": to.holds(b""),
    "binary": to.holds(np.random.default_rng(3).bytes(4000)),
    "cut in a row": to.cut(0.6),
    "rows reversed": to.lines(lambda head, rows: [head, *rows[::-1]]),
    "lost": to.gone,
}


def _reordered(*columns):
    order = np.random.default_rng(5).permutation(10)
    return to.table(lambda t: t.assign(**{name: t[name].to_numpy()[order] for name in columns}))


def _without(name):
    return to.table(lambda t: t.drop(columns=name))


def _both_clocks(factor, shift_s=0.0):
    change = to.later(shift_s, factor=factor)
    return to.both(change, to.beside("force.csv", change))


OF_FRAMES = {
    **{f"{name} is {value!r}": to.cell(name, 4, value) for name, value in (
        ("time_s", "abc"), ("time_s", "inf"), ("time_s", 0.0), ("frame", 1.5),
        ("frame", 2), ("color", ""), ("color", "../../../../secret.png"),
        ("color", "color\\000003.png"), ("color", "./color/000004.png"), ("color", "a\nb"),
    )},
    "color of 5000 letters": to.cell("color", 2, "x" * 5000),
    "no depth": _without("depth"),
    "two rows": to.table(lambda t: t.iloc[:2]),
    "no fifth and sixth frame": to.table(lambda t: t.drop(index=[5, 6])),
    "color in another order": _reordered("color"),
    "depth in another order": _reordered("depth"),
    "both clocks since 1970": _both_clocks(1, 1.7e9),
    "both clocks in ms": _both_clocks(1e3),
}  # fmt: skip
OF_FORCE = {
    **{f"{name} is {value!r} in row {at + 1}": to.cell(name, at, value) for name, at, value in (
        ("v2", 7, "nan"), ("v2", 7, "inf"), ("v1", 2, "abc"), ("v5", 0, ""), ("v5", 0, "1e400"),
        ("v5", 0, "1,5"), ("time_s", 40, -9.0),
    )},
    "a field of 2 MB": to.row(2, lambda one: "x" * 2_000_000 + one),
    "no v3": _without("v3"),
    "ends early": to.table(lambda t: t.iloc[:2500]),
    "half a second is missing": to.table(lambda t: t.drop(t.index[2000:2500])),
    "every tenth sample": to.table(lambda t: t.iloc[::10]),
    "units under the header": to.lines(lambda head, rows: [head, "s,V,V,V,V,V,V", *rows]),
    "times of day": to.table(
        lambda t: t.assign(time_s=[f"19:34:{s:09.6f}" for s in t["time_s"] + 1])
    ),
    "another wrench beside": to.table(
        lambda t: t.assign(**{name: 1e3 * k for k, name in enumerate(WRENCH)})
    ),
    "volts in mV": to.scaled(1e3, *GAUGES),
    "a gauge dead": to.scaled(0, "v2"),
    "a gauge saturated": to.table(lambda t: t.assign(v1=(t["v1"] * 5e4).clip(-10, 10))),
    "a gauge amplified 50 times": to.scaled(50, "v1"),
    "noise": to.table(lambda t: t.assign(
        **dict(zip(GAUGES, np.random.default_rng(2).normal(size=(6, len(t))), strict=True)))),
    "at 1.1 speed": to.later(0, factor=1.1),
    **{f"{shift:+g} s late": to.later(shift) for shift in (0.02, 0.2, -0.5, 30)},
}  # fmt: skip
OF_WRENCH = {
    "in kN": to.scaled(1e-3, *WRENCH),
    "force in mN": to.scaled(1e3, *FORCES),
    "torque in mNm": to.scaled(1e3, *TORQUES),
    "force in kgf": to.scaled(1 / 9.81, *FORCES),
    "sign": to.scaled(-1, *WRENCH),
    "fx and fz exchanged": to.table(lambda t: t.rename(columns={"fx_n": "fz_n", "fz_n": "fx_n"})),
    "force of 1e200": to.scaled(1e200, *WRENCH),
    "reversed": to.table(lambda t: t.assign(**{n: t[n].to_numpy()[::-1] for n in WRENCH})),
    "no unloaded beginning": to.later(-1.2),
}
OF_CURVE = WRITTEN | {
    "three rows": to.table(lambda t: t.iloc[:3]),
    "no force": _without("force_N"),
    "a torque for a force": to.table(lambda t: t.rename(columns={"force_N": "torque_Nm"})),
    "two unknown columns": to.table(lambda t: t.set_axis(["a", "b"], axis=1)),
    "two depths of one name": to.table(
        lambda t: t.set_axis(["depth_a_mm", "f_n"], axis=1).assign(depth_b_mm=t["tip_position_m"])
    ),
    "depth of one value": to.scaled(0, "tip_position_m"),
    "two depths": to.table(lambda t: t.assign(depth_mm=t["tip_position_m"])),
    "no unit of depth": to.table(lambda t: t.rename(columns={"tip_position_m": "depth"})),
    "depth in mm said to be m": to.scaled(1e3, "tip_position_m"),
    "sign of the depth": to.scaled(-1, "tip_position_m"),
    "sign of the force": to.scaled(-1, "force_N"),
    "a force of 1": to.cell("force_N", 40, 1.0),
    "noise": to.table(lambda t: t.assign(
        force_N=1e-9 * np.random.default_rng(3).normal(size=len(t)))),
}  # fmt: skip
FORMS = ("BOM", "no header", "binary", "cut in a row", "lost")
ENTRIES = {
    f"{BLOCK}/kinect/08/frames.csv": {name: WRITTEN[name] for name in FORMS} | OF_FRAMES,
    f"{BLOCK}/kinect/08/force.csv": WRITTEN | OF_FORCE,
    f"{COW}/bench_cam/back/force.csv": OF_WRENCH,
    "curve.csv": OF_CURVE,
}
