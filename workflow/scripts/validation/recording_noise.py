"""Noise of the lab's recordings against their truth, as config/observations.yaml has it.

    python -m validation.recording_noise RUN

of the folder of a finished `make validation`; writes ``recording_noise.csv`` there, one row for
each capture, and prints them together for each sensor.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
from palpate.capture.tables import columns_of
from palpate.estimate.direct.deviations import correlation_length
from palpate.estimate.direct.motion import load_motion
from palpate.estimate.direct.table import axes_across
from palpate.json_fields import read_json
from palpate.npz import read_npz
from palpate.surface.alignment import load_alignment
from palpate.surface.pose import to_object
from palpate.units import FROM_MEDIAN
from palpate.vision.force import FORCE
from palpate.vision.probe import ALONG_STD, TIP
from scipy.interpolate import PchipInterpolator
from validation.observations import Contact

# Errors of the tip that a rig's captures share, and what goes with its mean and deviation.
SHARED, SPREAD = ("tip_m", "across_1_m", "across_2_m"), ("tip_by_depth", "clock_error_s", "scale")
DOWN = np.array([0.0, 0.0, -1.0])
# Deeper than this the tip presses; farther above than this it is at rest [m].
PRESSED_M, CLEAR_M = 0.0005, 0.0005
# Residuals beyond so many deviations are outliers; a surface that moves by so many shows a scale.
OUTLYING, MOVING = 5.0, 10.0


def noise_of(results: Path, name: str, sensor: str, capture: str) -> dict:
    """Errors of a capture: of tip [m], clock [s], force [N], and displacements [m]."""
    folder = results / name / sensor / capture
    truth = read_npz(results / "lab" / name / sensor / capture / "truth.npz")
    path, motion = pd.read_csv(folder / "path.csv"), load_motion(folder / "motion.npz")
    pose = load_alignment(folder / "alignment.json").camera_from_object
    depth_m, real = truth["depth_m"], truth["camera_from_object"]
    pressed, rest = depth_m > PRESSED_M, depth_m < -CLEAR_M
    way = np.vstack([DOWN, axes_across(DOWN)])
    tip_m = to_object(pose, columns_of(path, TIP)) @ way.T
    off = (tip_m - to_object(real, truth["tip_m"]) @ way.T)[pressed]
    row = {"object": name, "sensor": sensor, "capture": capture}
    row |= dict(zip(SHARED, off.mean(axis=0), strict=True))
    # What goes evenly with the depth, and what is left from frame to frame.
    line = np.polynomial.Polynomial.fit(depth_m[pressed], off[:, 0], 1)
    left = off[:, 0] - line(depth_m[pressed])
    row["tip_by_depth"] = line.convert().coef[1]
    row["tip_over_stated"] = left.std(ddof=2) / np.nanmedian(path[ALONG_STD])
    row["tip_alike"] = float(left[1:] @ left[:-1] / (left @ left))
    clock = read_json(folder / "clock.json")
    row["clock_error_s"] = clock["offset_s"] - float(truth["clock_offset_s"])
    force_n = columns_of(path, FORCE) @ pose[:3, :3] @ DOWN
    row["force_n"] = (force_n - truth["force_n"] @ real[:3, :3] @ DOWN)[rest].std()
    contact = Contact.read(results / "lab" / name / f"contact-{capture.partition('-')[0]}.npz")
    moved_m = contact.motion(motion.cell_m, motion.normal)
    true_m = PchipInterpolator(contact.depth_m, np.nan_to_num(moved_m))(np.clip(depth_m, 0, None))
    gap = np.where(np.isfinite(moved_m).all(axis=0), motion.moved_m - true_m, np.nan)
    seen = np.isfinite(gap) & pressed[:, None]
    scaled = (gap / motion.noise_std_m)[seen]
    row["surface_over_stated"] = FROM_MEDIAN * np.median(np.abs(scaled))
    row["outliers"] = (np.abs(scaled) > OUTLYING * row["surface_over_stated"]).mean()
    row["missing"] = 1 - np.isfinite(motion.moved_m[pressed]).mean()
    row["stated_m"] = np.median(motion.noise_std_m[seen])
    row["alike_m"] = correlation_length(motion.cell_m, gap[pressed])
    # Only where the surface moves by much more than its noise.
    moves = np.abs(true_m[seen]).max() > MOVING * row["stated_m"]
    row["scale"] = (gap * true_m)[seen].sum() / (true_m[seen] ** 2).sum() if moves else np.nan
    return row


def together(rows: pd.DataFrame) -> pd.DataFrame:
    """By sensor: deviations of what a rig's captures share and of each one's own, and medians."""
    medians, found = list(rows.columns[rows.columns.get_loc("tip_over_stated") :]), []
    for sensor, part in rows.groupby("sensor"):
        row = {"sensor": sensor, "captures": len(part)}
        for name in SHARED:
            of_rig = part.groupby("object")[name]
            row[f"rig_{name}"] = np.sqrt((of_rig.mean() ** 2).mean())
            row[f"capture_{name}"] = np.sqrt(of_rig.var().mean())
        for name in SPREAD:
            row |= {f"{name}_mean": part[name].mean(), f"{name}_std": part[name].std()}
        row |= part[[name for name in medians if name not in SPREAD]].median()
        found.append(row)
    return pd.DataFrame(found).set_index("sensor").T


def main() -> None:
    """Measure all captures of a run."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0], allow_abbrev=False)
    parser.add_argument("run", type=Path)
    run = parser.parse_args().run
    results = run / "results"
    found = sorted(results.glob("*/*/*/motion.npz"))
    if not found:
        expected = f"expected what `make validation` leaves in {results}"
        parser.exit(1, f"error: run: {expected}, found no motion.npz\n")
    rows = [noise_of(results, *path.relative_to(results).parts[:3]) for path in found]
    table = pd.DataFrame(rows)
    table.to_csv(run / "recording_noise.csv", index=False)
    print(together(table).to_string(float_format="{:.4g}".format))


if __name__ == "__main__":
    main()
