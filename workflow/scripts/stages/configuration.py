"""The run's configuration and versions."""

import platform

from palpate.report import outputs
from palpate.report.settings_words import describe
from palpate.workflow.digest import pins
from palpate.workflow.job import run

# What results come from; all others stand in environment.lock.
NAMED = (
    "snakemake numpy scipy pandas opencv-python-headless open3d-cpu trimesh pytetwild pyvista vtk "
    "meshio scikit-fem pypardiso matplotlib plotly"
).split()


def main(snakemake):
    """Write configuration.md."""
    params, locked = snakemake.params, pins()
    versions = {"palpate": params.version, "Python": platform.python_version()}
    versions |= {name: locked[name] for name in NAMED}
    outputs.write({"md": describe(params.config, versions)}, snakemake.output)


run(main, snakemake)
