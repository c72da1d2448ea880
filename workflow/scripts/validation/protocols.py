"""One indentation of the lab by many protocols: each capture's own estimate beside the truth.

    python -m validation.protocols protocols/results

Prints the table and writes ``protocols.csv`` and ``protocols.md`` there. Only this package reads
the lab's truth.
"""

import sys
from collections.abc import Mapping
from pathlib import Path

import pandas as pd
from palpate.json_fields import read_json
from palpate.markdown import rows_of
from palpate.yaml_files import load_yaml

ROOT = Path(__file__).resolve().parents[3]
MODULI = {"E [kPa]": ("youngs_modulus_pa", 1e-3), "nu": ("poisson_ratio", 1.0)}
MODULI |= {"E* [kPa]": ("reduced_modulus_pa", 1e-3)}


def protocols_table(lab: Mapping, results: Path) -> pd.DataFrame:
    """One row for each capture: its protocol, moduli with 95 % intervals, and whether they hold."""
    rows = []
    for name, spec in lab["objects"].items():
        truth = read_json(results / "lab" / name / "material.json")
        for sensor, captures in spec["recordings"].items():
            for capture in captures:
                path = results / name / sensor / capture / "direct.json"
                found = read_json(path) if path.is_file() else None
                known = {"object": name, "capture": capture, "protocol": protocol_of(spec, capture)}
                rows.append(known | _row(found, truth))
    return pd.DataFrame(rows)


def protocol_of(spec: Mapping, capture: str) -> str:
    """What the lab's file says of a capture beside what it says of all captures."""
    said = [
        f"{name} {value:g}" if isinstance(value, float | int) else name
        for name, value in spec["motions"].get(capture, {}).items()
    ]
    further = {
        "beside the point": capture in spec["pressed_at"],
        "rig errors": "device" in spec,
        "inclined": "direction" in spec["object"]["points"][capture.split("-")[0]],
        "unbonded": "table_friction" in spec["contact"],
    }
    return ", ".join([*said, *(name for name in further if further[name])]) or "plain"


def _row(found: Mapping | None, truth: Mapping) -> dict:
    if found is None:
        return dict.fromkeys(MODULI, "none") | {"holds": "rejected"}
    row, missed = {}, []
    for title, (name, scale) in MODULI.items():
        value, low, high = (found[name][end] for end in ("value", "low", "high"))
        row[title] = f"{value * scale:.3g} ({low * scale:.3g} to {high * scale:.3g})"
        if not low <= truth[name] <= high:
            missed.append(title.split(" ")[0])
    return row | {"holds": "no: " + ", ".join(missed) if missed else "yes"}


def main(results: Path) -> None:
    """Print and write the table."""
    found = protocols_table(load_yaml(ROOT / "config/protocols_lab.yaml"), results)
    found.to_csv(results / "protocols.csv", index=False)
    text = "\n".join(rows_of(list(found.columns), found.to_numpy())) + "\n"
    (results / "protocols.md").write_text(text, encoding="utf-8")
    sys.stdout.write(text)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
