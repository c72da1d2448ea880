"""The truth gate: what the default lab's captures give, against the materials they are made of.

    python tools/truth_gate.py begin             # before the run: notes of which code it is
    python tools/truth_gate.py record            # after it: writes tests/truth/record.csv
    python tools/truth_gate.py check             # the record is of this code, within its limits
    python tools/truth_gate.py change force=1.05 # estimates with a fault that is made on purpose

`make truth` runs the first two, `make lint` the third.

A recommended interval is wide by the uncertainty of nu, law and contact, which would hide a wrong
force, depth or table. So each object is estimated with its nu and law known, too.
"""

import argparse
import ast
import hashlib
import json
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import yaml
from palpate.estimate.direct.estimate import DirectEstimate, estimate_direct
from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.options import Fit, ProbeUncertainty
from palpate.modulus import LABELS, columns
from palpate.report.estimate_rows import direct_rows
from palpate.workflow.digest import pins
from palpate.workflow.estimate_inputs import read_indentations
from validation.estimates import accuracy_table

ROOT = Path(__file__).resolve().parents[1]
RUN, RECORD = ROOT / "results/truth", ROOT / "tests/truth/record.csv"
PROBE = yaml.safe_load((ROOT / "config/probes/nano25_sphere.yaml").read_text())
# What the numbers depend on, below the project.
SCRIPTS = "workflow/scripts"
PLACES = tuple(f"{SCRIPTS}/palpate/{name}" for name in (
    "capture", "vision", "surface", "solid", "estimate", "json_fields.py", "mkl.py", "modulus.py",
    "npz.py", "open3d_core.py", "units.py", "yaml_files.py", "config", "workflow/capture_inputs.py",
    "workflow/estimate_inputs.py", "workflow/object_inputs.py"))  # fmt: skip
PLACES += (f"{SCRIPTS}/virtual_lab", f"{SCRIPTS}/stages", "config/meshes")
PLACES += ("config/config.yaml", "config/lab.yaml", "config/sensors/bumblebee.yaml")
PLACES += ("config/sensors/kinect.yaml", "config/probes/nano25_sphere.yaml")
PLACES += ("tests/truth/config.yaml",)
KINDS = (".py", ".yaml", ".vtu")
# Of each joint estimate: the modulus that its captures give when nu and law are known.
KNOWN, KNOWN_BAND = "youngs_modulus_1s_pa", 0.02
# Of a law's parameter, in standard deviations from the true 0.
LAW_DEVIATIONS = 3.0
# Recommended intervals that may miss by chance, and the least part of single captures' that hold.
MOST_MISSED, LEAST_HELD = 1, 0.9
# Standard deviation of law parameters about neo-Hooke's 0, where that is the true one.
LAW_STD = 1e-3
LAWS = ("force_law", "motion_law")
STEMS = {name: name.removesuffix("_pa") for name in LABELS}
KEPT = ["object", "sensor", "capture", "captures", "recommended"]
KEPT += [
    c for name in LABELS for c in (f"true_{name}", *columns(name)[:3], f"{STEMS[name]}_covered")
]
KEPT += [column for law in LAWS for column in (law, f"{law}_std")]
KEPT += [f"known_{KNOWN}", "effective_depth_m", "warnings"]
Changed = Callable[[DirectIndentation], DirectIndentation]


def scaled(name: str, by: float) -> Changed:
    """Fault of a whole rig: ``force``, ``depth`` or ``table`` is so many times too large."""

    def changed(one: DirectIndentation) -> DirectIndentation:
        if name == "table":
            table = replace(one.table, force_per_modulus_m2=by * one.table.force_per_modulus_m2)
            return replace(one, table=table)
        fields = {"force": ["force_n"], "depth": ["depth_m", "tip_depth_m"]}[name]
        return replace(one, **{field: by * getattr(one, field) for field in fields})

    return changed


def estimates_of(
    results: Path,
    declared: Path,
    captures: Mapping[str, Sequence[str]],
    options: Fit,
    changes: Sequence[Changed],
) -> list[DirectEstimate]:
    """Estimate an object from captures of a run, with each of some changes.

    Parameters
    ----------
    results, declared : Path
        Folders of the object's results and of what was dropped of it.
    captures : mapping
        Names by sensor.
    options : Fit
    changes : sequence of callable
        What is made of each capture before.
    """
    read, templates = [], (declared / "template.ply", results / "template.ply")
    for sensor, names in captures.items():
        folders = [results / sensor / name for name in names]
        points = [name.split("-")[0] for name in names]
        inputs = SimpleNamespace(
            object=declared / "object.yaml",
            template=next(path for path in templates if path.is_file()),
            tables=[str(results / f"indentation-{point}.npz") for point in points],
            paths=[str(folder / "path.csv") for folder in folders],
            clocks=[str(folder / "clock.json") for folder in folders],
            motions=[str(folder / "motion.npz") for folder in folders],
            alignments=[str(folder / "alignment.json") for folder in folders],
        )
        spec = yaml.safe_load((ROOT / f"config/sensors/{sensor}.yaml").read_text())
        read += read_indentations(inputs, PROBE, spec, options)
    known, radius = ProbeUncertainty.of(PROBE), PROBE["indenter"]["radius_m"]
    return [
        estimate_direct([change(one) for one in read], options, known, radius_m=radius)
        for change in changes
    ]


def estimates_of_known(
    results: Path,
    declared: Path,
    captures: Mapping[str, Sequence[str]],
    material: Mapping,
    changes: Sequence[Changed],
    **options: float,
) -> list[DirectEstimate]:
    """Estimate an object whose nu and law are known; see `estimates_of`."""
    assert material["law"] == "neo_hookean"
    law = {"force_law_std": LAW_STD, "motion_law_std": LAW_STD}
    fit = Fit(poisson_ratio=material["poisson_ratio"], **law, **options)
    return estimates_of(results, declared, captures, fit, changes)


def record_of(folder: Path, change: Changed | None = None) -> pd.DataFrame:
    """What a finished run found: a row an estimate, each interval beside the truth.

    With a change, what all captures of each object and sensor give together.

    Raises
    ------
    ValueError
        If there is no run.
    """
    results, made = folder / "results", [change or (lambda one: one)]
    captures, singles, groups, joints, known, materials = [], [], [], [], [], {}
    files = sorted(results.glob("*/*/direct.json"))
    if not files:
        raise ValueError(f"{results}: expected joint estimates, found none: run `make truth`")
    for path in files:
        place = path.parents[1], folder / "captures" / path.parts[-3]
        group = dict(zip(("object", "sensor"), path.parts[-3:-1], strict=True))
        group |= {"provenance": "simulated"}
        material = json.loads((results / f"lab/{group['object']}/material.json").read_text())
        joint = json.loads(path.read_text())
        which = {group["sensor"]: joint["captures"]}
        if change:
            joint |= estimates_of(*place, which, Fit(), made)[0].to_dict()
        for one in joint["captures"] * (change is None):
            captures.append(group | {"capture": one, "point": one.partition("-")[0]})
            singles.append(json.loads((path.parent / one / path.name).read_text()))
        (alone,) = estimates_of_known(*place, which, material, made)
        known.append(alone.moduli[KNOWN].value)
        groups.append(group)
        joints.append(joint)
        materials[group["object"]] = material
    rows = pd.DataFrame(direct_rows(captures, singles, groups, joints))
    rows.loc[rows["recommended"], f"known_{KNOWN}"] = known
    return accuracy_table(rows, materials).reindex(columns=KEPT).apply(_rounded)


def _rounded(column: pd.Series) -> pd.Series:
    """Five digits: what follows differs from machine to machine."""
    return column.map(lambda x: float(f"{x:.5g}")) if column.dtype == float else column


def failures(record: pd.DataFrame) -> list[str]:
    """What is wrong with a record beyond chance, a line each."""
    joint, single = record[record["recommended"]], record[~record["recommended"]]
    of = joint["object"] + " " + joint["sensor"] + " "
    right = {name: joint[f"{stem}_covered"].astype(bool) for name, stem in STEMS.items()}
    missed = [f"{who}{name}" for name, held in right.items() for who in of[~held]]
    found, total = [], len(joint) * len(LABELS)
    if len(missed) > MOST_MISSED:
        found.append(f"{len(missed)} of {total} recommended intervals miss: {', '.join(missed)}")
    for name, stem in STEMS.items():
        held = single[f"{stem}_covered"].astype(bool)
        if held.mean() < LEAST_HELD:
            found.append(f"{name}: {held.sum()} of {len(held)} intervals of single captures hold")
        for one, part in joint.groupby("object"):
            _, low, high, _ = columns(name)
            if part[low].max() > part[high].min():
                found.append(f"{one}: {name}: the sensors' intervals exclude each other")
    for who, row in zip(of, joint.to_dict("records"), strict=True):
        for law in LAWS:
            if abs(row[law]) > LAW_DEVIATIONS * row[f"{law}_std"]:
                found.append(f"{who}{law}: found {row[law]:+.2f} +- {row[f'{law}_std']:.2f}")
        off = row[f"known_{KNOWN}"] / row[f"true_{KNOWN}"] - 1
        if abs(off) > KNOWN_BAND:
            found.append(f"{who}{KNOWN} with nu and law known: {100 * off:+.1f} % off")
        if isinstance(row["warnings"], str):
            found.append(f"{who}warning: {row['warnings']}")
    return found


def digest(root: Path = ROOT) -> str:
    """Digest of the code, configuration and versions that the record depends on.

    Raises
    ------
    ValueError
        If a place of it is missing.
    """
    total = hashlib.sha256(repr(sorted(pins(root / SCRIPTS).items())).encode())
    for place in (root / name for name in PLACES):
        files = [path for path in (place, *place.rglob("*")) if path.suffix in KINDS]
        if not files:
            raise ValueError(f"{place}: expected files that the record depends on, found none")
        for path in sorted(files):
            total.update(f"{path.relative_to(root).as_posix()}\0".encode() + meaning(path))
    return total.hexdigest()[:16]


def meaning(path: Path) -> bytes:
    """What a file says to the machine: without comments, docstrings and layout."""
    if path.suffix == ".yaml":
        return repr(yaml.safe_load(path.read_text(encoding="utf-8"))).encode()
    if path.suffix != ".py":
        return path.read_bytes()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        documented = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        if documented and ast.get_docstring(node):
            node.body = node.body[1:]
    return ast.dump(tree).encode()


def check(record: Path = RECORD) -> list[str]:
    """What is wrong with a record, a line each."""
    remedy = "run `make truth` and commit what it writes"
    if not record.is_file():
        return [f"expected a record, found none: {remedy}"]
    code, *_ = record.read_text(encoding="utf-8").partition("\n")
    stale = code != f"# code: {digest()}"
    found = [f"expected a record of this code, found one of another: {remedy}"] * stale
    return found + failures(read_record(record))


def read_record(path: Path) -> pd.DataFrame:
    """Read a record."""
    return pd.read_csv(path, comment="#", dtype={"capture": str, "warnings": object})


def show(record: pd.DataFrame) -> list[str]:
    """Print how a record's intervals lie, and what is wrong with it."""
    for name, stem in STEMS.items():
        held = record.groupby("recommended")[f"{stem}_covered"].agg(["sum", "count"])
        counts = "; ".join(f"{row['sum']} of {row['count']}" for _, row in held[::-1].iterrows())
        sys.stdout.write(f"{name}: {counts} hold (joint; single)\n")
    return failures(record)


def record_run() -> list[str]:
    """Write the record of a finished run."""
    noted = RUN / "code"
    code = noted.read_text(encoding="utf-8") if noted.is_file() else None
    if code != digest():
        raise ValueError(f"{RUN}: expected a run of this code, found one of another: `make truth`")
    record = record_of(RUN)
    RECORD.write_text(f"# code: {code}\n{record.to_csv(index=False)}", encoding="utf-8")
    return show(record)


def main(arguments: Sequence[str]) -> list[str]:
    """Carry out a verb; what is wrong, a line each."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("verb", choices=("begin", "record", "check", "change"))
    kinds = re.compile(r"(force|depth|table)=\d+(\.\d+)?")
    parser.add_argument("fault", nargs="?", help="of change: force, depth or table=FACTOR")
    options = parser.parse_args(arguments)
    if (options.verb == "change") != bool(kinds.fullmatch(options.fault or "")):
        parser.error("fault: expected as force=1.05 with change, and only with it")
    if options.verb == "begin":
        RUN.mkdir(parents=True, exist_ok=True)
        (RUN / "code").write_text(digest(), encoding="utf-8")
        return []
    if options.verb == "change":
        name, _, by = options.fault.partition("=")
        return show(record_of(RUN, scaled(name, float(by))))
    return check() if options.verb == "check" else record_run()


if __name__ == "__main__":
    try:
        wrong = main(sys.argv[1:])
    except ValueError as error:
        wrong = [str(error)]
    sys.exit("\n".join(f"truth gate: {line}" for line in wrong) or None)
