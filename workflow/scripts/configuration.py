"""The run's configuration and versions, and the list of what it makes."""

import platform
import tomllib
from pathlib import Path

from job import run
from palpate.capture.files import whole_file
from palpate.study.run_description import describe, pinned

# What results come from; all others stand in environment.lock.
NAMED = (
    "snakemake numpy scipy pandas opencv-python-headless open3d-cpu trimesh pytetwild pyvista vtk "
    "meshio scikit-fem pypardiso matplotlib plotly"
).split()


def main(snakemake):
    """Write configuration.md and wanted.txt."""
    inputs, params = snakemake.input, snakemake.params
    project = tomllib.loads(Path(inputs.project).read_text(encoding="utf-8"))["project"]
    versions = {"palpate": project["version"], "Python": platform.python_version()}
    versions |= pinned(Path(inputs.lock).read_text(encoding="utf-8"), NAMED)
    with whole_file(snakemake.output.md) as part:
        part.write_text(describe(params.config, versions), encoding="utf-8")
    with whole_file(snakemake.output.wanted) as part:
        part.write_text("".join(f"{name}\n" for name in params.wanted), encoding="utf-8")


run(main, snakemake)
