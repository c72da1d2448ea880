"""The run's configuration and versions."""

import platform
from pathlib import Path

from palpate.report import outputs
from palpate.report.run_description import describe, pinned
from palpate.workflow.job import run

# What results come from; all others stand in environment.lock.
NAMED = (
    "snakemake numpy scipy pandas opencv-python-headless open3d-cpu trimesh pytetwild pyvista vtk "
    "meshio scikit-fem pypardiso matplotlib plotly"
).split()


def main(snakemake):
    """Write configuration.md."""
    inputs, params = snakemake.input, snakemake.params
    versions = {"palpate": params.version, "Python": platform.python_version()}
    versions |= pinned(Path(inputs.lock).read_text(encoding="utf-8"), NAMED)
    outputs.write({"md": describe(params.config, versions)}, snakemake.output)


run(main, snakemake)
