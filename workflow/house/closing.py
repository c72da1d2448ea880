"""What a run ends with: where the results are, and the stiffness of each object."""

import sys
from pathlib import Path

import pandas as pd


def closing_lines(results: Path) -> list[str]:
    """Sum up a results folder in a few lines.

    Parameters
    ----------
    results : Path
        Folder that holds ``summary.csv``.

    Returns
    -------
    list of str
        A line for each fit, and where to look next.
    """
    summary = pd.read_csv(results / "summary.csv", dtype={"capture": str, "point": str})
    lines = [f"Results are in {results}/: tables/, figures/, summary.csv"]
    for row in summary.itertuples():
        lines.append(f"  {row.object}, {row.sensor}, {row.capture}, {row.method}: {_moduli(row)}")
    if (summary["provenance"] == "simulated").any():
        lines.append("Rows from simulated captures are marked as such in the tables.")
    return lines


def _moduli(row: object) -> str:
    reduced = f"E* {row.reduced_modulus_pa / 1000:.2f} kPa"
    if pd.isna(row.youngs_modulus_pa):
        return reduced
    return f"E {row.youngs_modulus_pa / 1000:.2f} kPa, nu {row.poisson_ratio:.3f}, {reduced}"


if __name__ == "__main__":
    print("\n".join(closing_lines(Path(sys.argv[1]))))
