"""The cheap jobs of the workflow on the block's capture, by their real scripts."""

import io
import json
import runpy
from collections.abc import Mapping
from contextlib import redirect_stderr
from pathlib import Path
from types import SimpleNamespace

import yaml
from stage_runs import Named

from corrupted.places import BLOCK, ROOT

HERE = "results/foam_block/kinect"
OUT = f"{HERE}/08"
KEPT = "config/meshes/foam_block.vtu"
NAMES = {"object": "foam_block", "sensor": "kinect", "capture": "08"}


def jobs(config: Mapping) -> dict[str, tuple[Mapping, Mapping, Mapping]]:
    """Inputs, outputs and params of jobs, by script: to the Hertz fit, and a kept mesh's."""
    films, background = {"capture": f"{BLOCK}/kinect/08"}, f"{BLOCK}/kinect/background"
    spec = _spec(f"{BLOCK}/object.yaml")
    sensor = {"sensor": _spec("config/sensors/kinect.yaml")}
    probe = {"probe": _spec(f"config/probes/{spec['probe']}.yaml")}
    thing = {"object": f"{BLOCK}/object.yaml"}
    template = {"template": f"{BLOCK}/{spec['template'].get('file', 'template.ply')}"}
    model, mask = {"model": f"{HERE}/background.npz"}, {"mask": f"{OUT}/mask.npz"}
    plane, pose = {"plane": f"{HERE}/support_plane.json"}, {"pose": f"{OUT}/probe_pose.csv"}
    force, clock = {"force": f"{OUT}/force.csv"}, {"clock": f"{OUT}/clock.json"}
    path = {"path": f"{OUT}/path.csv"}
    cloud, alignment = f"{OUT}/rest_cloud.npz", {"alignment": f"{OUT}/alignment.json"}
    optics, calibrations = {"optics": None}, {"calibrations": None}
    alike = thing | template | pose | force
    onset = {"onset_force_n": config["hertz"]["onset_force_n"]}
    seen, plain = {"background": background}, {"options": config["background"]}
    on_table, first = {"options": config["support_plane"]}, {"frames": [0]}
    return {
        "background_model": (seen, model, sensor | plain),
        "support_plane": (seen | optics, plane, sensor | on_table | {"seed": config["seed"]}),
        "mask": (films | model, mask, sensor | plain),
        "probe_pose": (films | optics | calibrations, pose,
                       sensor | probe | {"options": config["probe_pose"]}),
        "force": (films | thing | pose | plane | calibrations, force | path | clock,
                  sensor | probe | {"options": config["force"]}),
        "clouds": (films | optics | alike | plane | mask, {"clouds": cloud},
                   sensor | probe | first | {"options": config["clouds"]}),
        "align": (alike | plane | {"cloud": cloud}, alignment,
                  probe | onset | {"options": config["tracking"]["alignment"]}),
        "hertz": (alike | alignment | clock, {"fit": f"{OUT}/hertz.json"},
                  probe | {"options": config["hertz"], "rig": config["direct"]["fit"]["rig"]}),
        "solid_mesh": (thing | template | {"kept": KEPT},
                       {"solid": "results/solid.vtu", "quality": "results/quality.json"}, {}),
    }  # fmt: skip


def _spec(path: str) -> dict:
    return yaml.safe_load(Path(path).read_text())


def run_chain(config: Mapping) -> float:
    """Run all jobs up to the Hertz fit; its effective reduced modulus [Pa]."""
    for script, job in jobs(config).items():
        run_script(script, *job)
        if script == "hertz":
            fit = json.loads(Path(job[1]["fit"]).read_text())
            return fit["recommended"]["reduced_modulus_pa"]
    raise ValueError("jobs: expected the Hertz fit, found none")


def run_script(script: str, inputs: Mapping, outputs: Mapping, params: Mapping) -> None:
    """Run a script as Snakemake would; ValueError with the line that it ends with."""
    snakemake = SimpleNamespace(
        rule=script,
        wildcards=Named(**NAMES),
        log=Path("results/log.txt"),
        input=Named(**{name: path or [] for name, path in inputs.items()}),
        output=Named(**outputs),
        params=Named(**params),
    )
    path = ROOT / f"workflow/scripts/stages/{script}.py"
    with redirect_stderr(io.StringIO()) as told:
        try:
            runpy.run_path(str(path), init_globals={"snakemake": snakemake})
        except SystemExit:
            rows = [row for row in told.getvalue().splitlines() if row.startswith("error: ")]
            raise ValueError("\n".join(rows) or told.getvalue()) from None
