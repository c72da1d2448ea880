"""Runs of randomised rigs compared with their truth: errors, and how often the intervals hold.

    python -m validation.randomised_rigs validation/1 [validation/2 ...]

Prints the summary of all of them; writes ``validation.csv`` and ``validation.md`` into the last
one's folder. Only this package reads the lab's truth. A rejected capture is a row with the reason.
"""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from palpate.json_fields import read_fields
from palpate.markdown import rows_of
from palpate.modulus import LABELS, columns
from palpate.report.estimate_rows import direct_rows
from palpate.yaml_files import load_yaml
from scipy.stats import binomtest
from validation.estimates import accuracy_table

# Of the summary: name of the modulus, what it is called, and whether its errors are relative.
MODULI = {
    "effective_reduced_modulus_pa": ("effective E*", True),
    "reduced_modulus_pa": ("E*", True),
    "youngs_modulus_pa": ("E", True),
    "poisson_ratio": ("nu", False),
}


def estimates_of(folder: Path) -> pd.DataFrame:
    """One row for each object and sensor: its rig, its estimate, and the error of that."""
    lab, results = load_yaml(folder / "lab.yaml"), folder / "results"
    rows, materials = [], {}
    for name, spec in lab["objects"].items():
        materials[name] = spec["material"]
        for sensor in spec["recordings"]:
            path = results / name / sensor / "direct.json"
            group = {"object": name, "sensor": sensor, "provenance": "simulated"}
            row = group | {"rejected": reason(results, name, sensor)}
            if path.is_file():
                (row,) = direct_rows([], [], [group], [read_fields(path)])
            rows.append({"seed": lab["seed"]} | row | randomised(spec))
    table = pd.DataFrame(rows)
    wanted = ["point", "method", *(column for name in LABELS for column in columns(name))]
    table = table.reindex(columns=[*table, *(name for name in wanted if name not in table)])
    return accuracy_table(table, materials)


def randomised(spec: Mapping) -> dict:
    """What was randomised of an object that its errors may depend on."""
    return {
        "form": f"{spec['object']['support']['contact']} {spec['shape']['kind']}",
        "law": spec["material"]["law"],
        "depth_m": spec["motion"]["depth_m"],
        "rig": spec.get("rig", "lab"),
    }


def reason(results: Path, name: str, sensor: str) -> str:
    """Why there is no estimate of an object and a sensor: last lines of the logs."""
    patterns = f"logs/*/{name}-{sensor}*.log", f"logs/*/{name}-01.log"
    logs = [path for pattern in patterns for path in sorted(results.glob(pattern))]
    lines = [text.splitlines()[-1] for path in logs if (text := path.read_text().strip())]
    errors = [line for line in lines if line.startswith("error: ")]
    return "; ".join(errors) or "it was not tried"


def summary_of(table: pd.DataFrame) -> pd.DataFrame:
    """Errors and coverage of each modulus, over all estimates of runs."""
    rows = []
    for name, (title, relative) in MODULI.items():
        stem, scale, unit = name.removesuffix("_pa"), *((100, " %") if relative else (1, ""))
        errors = table[f"{stem}_error"].dropna().abs() * scale
        held = table[f"{stem}_covered"].dropna().astype(bool)
        value, low, high, *_ = columns(name)
        known, efficiency = table[table[low].notna()], table.get(f"{stem}_efficiency")
        width = (known[high] - known[low]) / 2
        width = width / known[value] * 100 if relative else width
        over_bound = "-" if efficiency is None else f"{(1 / efficiency).median():.2f}"
        # Estimates of one rig share its errors: what scatters are the rigs.
        rigs = max(table.loc[held.index, "rig"].nunique(), 1)
        rigs_held = binomtest(round(held.mean() * rigs) if len(held) else 0, rigs)
        interval = rigs_held.proportion_ci(method="wilson")
        ends = f"{100 * interval.low:.0f} to {100 * interval.high:.0f}"
        row = {"modulus": title, "estimates": len(errors)}
        row["median error"] = f"{errors.median():.3g}{unit}"
        row["90th percentile"] = f"{errors.quantile(0.9):.3g}{unit}"
        row["median half-width"] = f"{width.median():.3g}{unit}"
        row["over the Cramér-Rao bound"] = over_bound
        row["intervals that hold"] = f"{held.sum()} of {len(held)}"
        rows.append(row | {"share": f"{100 * held.mean():.0f} % ({ends})"})
    return pd.DataFrame(rows)


def shifts_of(table: pd.DataFrame, lab: Mapping) -> pd.DataFrame:
    """Shifts by each error alone, from the same object's recording without errors."""
    rows = []
    for _, row in table.iterrows():
        devices = lab["objects"][row["object"]].get("devices", {})
        kinect = row["sensor"].startswith(("kinect", "color_from"))
        nominal = "kinect_nominal" if kinect else "nominal"
        if row["sensor"] not in devices or row["sensor"] == nominal:
            continue
        same = (table["object"] == row["object"]) & (table["sensor"] == nominal)
        device, base = devices[row["sensor"]], table[same].iloc[0]
        size = f"{next(iter(device.values())):g}" if len(device) == 1 else "all"
        found = {"object": row["object"], "error": row["sensor"], "size": size}
        for name, (title, relative) in MODULI.items():
            shift = 100 * (row[name] / base[name] - 1) if relative else row[name] - base[name]
            found[title] = f"{shift:+.1f} %" if relative else f"{shift:+.3f}"
        missed = [MODULI[n][0] for n in MODULI if row[f"{n.removesuffix('_pa')}_covered"] is False]
        rows.append(found | {"holds": "no: " + ", ".join(missed) if missed else "yes"})
    return pd.DataFrame(rows)


def main(folders: Sequence[Path]) -> None:
    """Print and write the tables."""
    table = pd.concat([estimates_of(folder) for folder in folders], ignore_index=True)
    rejected = table[table["youngs_modulus_pa"].isna()]
    parts = [summary_of(table)] if len(rejected) < len(table) else []
    if len(folders) == 1:
        parts.append(shifts_of(table, load_yaml(folders[0] / "lab.yaml")))
    if len(rejected):
        parts.append(rejected[["seed", "object", "sensor", "form", "rejected"]])
    text = f"{len(table)} estimates of {table['rig'].nunique()} rigs, {len(rejected)} rejected.\n\n"
    tables = ["\n".join(rows_of(list(p.columns), p.to_numpy(dtype=str))) for p in parts]
    text += "\n\n".join(tables) + "\n"
    table.to_csv(folders[-1] / "validation.csv", index=False)
    (folders[-1] / "validation.md").write_text(text, encoding="utf-8")
    sys.stdout.write(text)


if __name__ == "__main__":
    if not sys.argv[1:]:
        sys.exit("error: folders: expected some, as validation/1, found none")
    try:
        main([Path(name) for name in sys.argv[1:]])
    except ValueError as error:
        sys.exit(f"error: {error}")
    except KeyError as error:
        sys.exit(f"error: direct.json: expected {error}, found none (run again with this version)")
