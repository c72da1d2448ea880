"""Figures of speed and accuracy, as ratios measured side by side in one run.

``make bench`` writes results/bench.csv (name,value,unit,against,section) and prints it;
``make bench sections="solver scale"`` measures just those.
"""

import sys
import sysconfig
import time
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from bench_growth import growth_rows
from bench_laws import law_rows
from bench_rig import rig_rows
from bench_scale import scale_rows
from bench_study import study_rows
from bench_tracking import tracking_rows
from palpate.capture.files import whole_file
from scipy import sparse
from scipy.sparse.linalg import splu
from virtual_lab.indentation import contact_problem
from virtual_lab.shapes import shape_of

ROOT = Path(__file__).resolve().parents[1]
ROUNDS, MEGABYTE, RADIUS_M = 7, 1e6, 0.00622


def ratio(ours, other) -> float:
    """Median over rounds of the other's time over ours, the two in turn."""
    ratios = []
    for _ in range(ROUNDS):
        seconds = []
        for function in (ours, other):
            start = time.perf_counter()
            function()
            seconds.append(time.perf_counter() - start)
        ratios.append(seconds[1] / seconds[0])
    return float(np.median(ratios))


def solver_rows() -> list[tuple]:
    """PARDISO and SuperLU on the tangent matrix of the lab's block; their installed sizes."""
    spec = yaml.safe_load((ROOT / "config/lab.yaml").read_text())["objects"]["foam_block"]
    place = np.array(spec["object"]["points"]["08"]["position_m"])
    model = shape_of(spec).model(place, spec["contact"])
    problem = contact_problem(spec, model, place, RADIUS_M)
    _, blocks = problem._elastic(np.zeros(problem.fixed.size))
    parts = [(np.arange(len(blocks)), blocks)]
    load = np.random.default_rng(0).normal(size=problem.tangent.count)
    upper = problem.tangent.matrix(parts)
    full = sparse.csc_matrix(upper + sparse.triu(upper, 1).T)

    def changed():
        # PARDISO keeps its factors for a matrix that it knows.
        blocks[0, 0, 0, 0, 0] *= 1 + 1e-9
        return problem.tangent.solve(parts, load)

    name = f"tangent of {problem.tangent.count} unknowns: PARDISO, pattern known"
    found = ratio(changed, lambda: splu(full, permc_spec="MMD_AT_PLUS_A").solve(load))
    packages = Path(sysconfig.get_path("purelib"))
    files = [p for folder in ("scipy", "scipy.libs") for p in (packages / folder).rglob("*")]
    scipy = sum(p.stat().st_size for p in files if p.is_file()) / MEGABYTE
    mkl = sum(p.stat().st_size for p in packages.parents[1].glob("libmkl*")) / MEGABYTE
    return [
        (name, found, "times faster", "SciPy's SuperLU"),
        ("installed size of PARDISO (MKL)", mkl, "MB", f"SciPy {scipy:.0f} MB"),
    ]


SECTIONS = {
    "solver": solver_rows,
    "tracking": tracking_rows,
    "scale": scale_rows,
    "study": study_rows,
    "growth": growth_rows,
    "laws": law_rows,
    "rig": rig_rows,
}
# Measured when they are named: a quarter of an hour each, the last some minutes.
APART = ("growth", "laws", "rig")


def main(target: Path, sections: list[str]) -> None:
    """Measure, write and print; all sections but those apart unless some are named."""
    unknown = set(sections) - set(SECTIONS)
    if unknown:
        sys.exit(f"bench: expected sections of {', '.join(SECTIONS)}, found {sorted(unknown)[0]}")
    tables = []
    for name in sections or (name for name in SECTIONS if name not in APART):
        table = pd.DataFrame(SECTIONS[name](), columns=["name", "value", "unit", "against"])
        table["value"] = [float(f"{value:.3g}") for value in table["value"]]
        print(table.to_string(index=False), flush=True)
        tables.append(table.assign(section=name))
    with whole_file(target) as part:
        pd.concat(tables).to_csv(part, index=False)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
