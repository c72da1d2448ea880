"""Widths that a plan forecasts of finished captures, beside those that their estimates have.

    python -m validation.forecasts CAPTURES RESULTS [SENSORS]

of a folder of objects, the results of a run, and the folder of the sensors' files; writes
``plan_forecasts.csv`` into the results. Camera, noise at rest, depth and frame rate are those of
the first capture, E and nu the lab's. What a plan rejects has no forecast.
"""

import sys
from functools import cache
from pathlib import Path

import pandas as pd
from palpate.config.probe import ProbeSpec
from palpate.config.sensor import SensorSpec
from palpate.estimate.direct.motion import load_motion
from palpate.json_fields import read_json
from palpate.plan import as_recorded
from palpate.solid.indentation_table import load_indentation
from palpate.solid.support import read_support
from palpate.surface.alignment import load_alignment
from palpate.surface.template import read_template
from palpate.units import PERCENT
from palpate.yaml_files import load_yaml

COMPARED = ("effective_reduced_modulus_pa", "reduced_modulus_pa", "youngs_modulus_pa")
NU = "poisson_ratio"
PROBES = Path("config/probes")


def forecasts(raw: Path, results: Path, sensors: Path) -> pd.DataFrame:
    """One row for each direct.json: half-widths as forecast and as found, moduli in per cent."""
    rows, rig = [], cache(rig_of)
    for path in sorted([*results.glob("*/*/direct.json"), *results.glob("*/*/*/direct.json")]):
        found = read_json(path)
        name, sensor = path.relative_to(results).parts[:2]
        capture, count = found["captures"][0], len(found["captures"])
        folder, point = results / name / sensor / capture, capture.partition("-")[0]
        files = {
            "path": pd.read_csv(folder / "path.csv"),
            "motion": load_motion(folder / "motion.npz"),
            "alignment": load_alignment(folder / "alignment.json"),
        }
        truth = read_json(results / "lab" / name / "material.json")
        guess = truth["youngs_modulus_pa"], truth["poisson_ratio"]
        known = rig(raw / name, results / name, point, sensors, sensor)
        planned, protocol = as_recorded(*known, **files, found=found, guess=guess)
        try:
            forecast = planned.forecast(protocol).half_width
        except ValueError:  # As of forces that stay within their noise: the plan rejects it.
            forecast = dict.fromkeys((*COMPARED, NU), float("nan"))
        row = {"object": name, "sensor": sensor, "captures": count}
        row |= {"capture": capture if path.parent.name == capture else "all"}
        for modulus in COMPARED:
            one, column = found[modulus], modulus.removesuffix("_pa")
            row[f"{column}_forecast_percent"] = PERCENT * forecast[modulus]
            row[f"{column}_found_percent"] = PERCENT * (one["high"] - one["low"]) / 2 / one["value"]
        row[f"{NU}_forecast"] = forecast[NU]
        rows.append(row | {f"{NU}_found": (found[NU]["high"] - found[NU]["low"]) / 2})
    return pd.DataFrame(rows)


def rig_of(raw: Path, results: Path, point: str, sensors: Path, sensor: str) -> tuple:
    """Table, template and support of a point, and the files of sensor and probe."""
    spec = load_yaml(raw / "object.yaml")
    places = (place / "template.ply" for place in (raw, results))
    template = next(path for path in places if path.is_file())
    return (
        load_indentation(results / f"indentation-{point}.npz"),
        read_template(template, unit=spec["template"]["unit"]),
        read_support(spec["support"]),
        SensorSpec.plain(load_yaml(sensors / f"{sensor}.yaml")),
        ProbeSpec.plain(load_yaml(PROBES / f"{spec['probe']}.yaml")),
    )


if __name__ == "__main__":
    of_run = [Path(path) for path in (*sys.argv[1:3], *(sys.argv[3:] or ["config/sensors"]))]
    forecasts(*of_run).to_csv(of_run[1] / "plan_forecasts.csv", index=False)
