"""What the captures of a run tell when all but the modulus is known, as it is of the lab's.

A recommended interval is wide by the doubts of nu, law and contact, which would hide a wrong force.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import yaml
from palpate.estimate.direct.estimate import DirectEstimate, estimate_direct
from palpate.estimate.direct.options import Fit
from palpate.run.direct_inputs import read_indentations

ROOT = Path(__file__).resolve().parents[1]
PROBE = yaml.safe_load((ROOT / "config/probes/nano25_sphere.yaml").read_text())
# Of the law's places about neo-Hooke's 0, where that is the true one.
LAW_STD = 1e-3


def estimates_of_known(
    results: Path,
    declared: Path,
    captures: Mapping[str, Sequence[str]],
    material: Mapping,
    *,
    forces: Sequence[float] = (1.0, 1.1),
    **known: float,
) -> list[DirectEstimate]:
    """Estimate an object from all its captures at its true nu and law, with each scale of forces.

    Parameters
    ----------
    results, declared : Path
        Folders of the object's results and of what was dropped of it.
    captures : mapping
        Names by sensor.
    material : mapping
        The lab's, neo-Hookean.
    forces : sequence of float
        What all forces are multiplied by.
    **known
        Options of the fit beside nu and the law.
    """
    assert material["law"] == "neo_hookean"
    law = {"force_law_std": LAW_STD, "motion_law_std": LAW_STD}
    options = Fit(poisson_ratio=material["poisson_ratio"], **law, **known)
    folders = [results / sensor / name for sensor, names in captures.items() for name in names]
    points = [folder.name.split("-")[0] for folder in folders]
    templates = (declared / "template.ply", results / "template.ply")
    inputs = SimpleNamespace(
        object=declared / "object.yaml",
        template=next(path for path in templates if path.is_file()),
        tables=[str(results / f"indentation-{point}.npz") for point in points],
        poses=[str(folder / "probe_pose.csv") for folder in folders],
        forces=[str(folder / "force.csv") for folder in folders],
        clocks=[str(folder / "clock.json") for folder in folders],
        motions=[str(folder / "motion.npz") for folder in folders],
        alignments=[str(folder / "alignment.json") for folder in folders],
    )
    presses = read_indentations(inputs, PROBE, options)
    radius = PROBE["indenter"]["radius_m"]
    scaled = [[replace(one, force_n=by * one.force_n) for one in presses] for by in forces]
    return [estimate_direct(each, options, radius_m=radius) for each in scaled]
