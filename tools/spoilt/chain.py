"""The cheap jobs of the workflow on a place, through their real scripts, each result kept."""

import hashlib
import io
import json
import os
import runpy
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

# What the scripts import, once for all children.
import palpate.estimate.hertz.record
import palpate.estimate.hertz.relaxation
import palpate.surface.checks
import palpate.vision.clouds
import palpate.vision.foreground
import palpate.vision.indentation
import palpate.vision.probe
import palpate.vision.stillness
import palpate.vision.support_plane  # noqa: F401
import yaml
from stage_runs import Named

from spoilt.place import CAPTURE, OBJECT, ROOT, SENSOR, Place

SCRIPTS = ROOT / "workflow/scripts/stages"

# What of a capture a job reads, where that is not all.
READ = {
    "mask": lambda file: file.name != "force.csv",
    "probe_pose": lambda file: file.name != "force.csv",
    "clouds": lambda file: file.name != "force.csv",
    "force": lambda file: file.suffix != ".png",
}


class Refused(Exception):  # noqa: N818 - an end, no error
    """A job ended with its line."""


def jobs(place: Place) -> list[dict]:
    """Jobs from the images to the Hertz fit, in order."""
    config, raw = place.config, _only(place.folder / "raw", "object.yaml")
    capture, background = _only(raw / SENSOR, "force.csv"), raw / SENSOR / "background"
    out = place.folder / "results" / OBJECT / SENSOR / CAPTURE
    sensor = _spec(place.folder / f"sensors/{SENSOR}.yaml")
    probe = _spec(place.folder / "probes" / f"{_spec(raw / 'object.yaml')['probe']}.yaml")
    spec = _spec(raw / "object.yaml")
    template = raw / spec["template"].get("file", "template.ply")
    model, plane = out.parent / "background.npz", out.parent / "support_plane.json"
    pose, force, mask = out / "probe_pose.csv", out / "force.csv", out / "mask.npz"
    cloud, alignment = out / "rest_cloud.npz", out / "alignment.json"
    optics = {"sensor": sensor}
    alike = {"object": raw / "object.yaml", "template": template, "pose": pose, "force": force}
    return [
        _job("background_model", {"background": background}, {"model": model}, sensor=sensor,
             options=config["background"]),
        _job("support_plane", {"background": background, "optics": None}, {"plane": plane},
             **optics, options=config["support_plane"], seed=config["seed"]),
        _job("mask", {"capture": capture, "model": model}, {"mask": mask}, **optics,
             options=config["background"]),
        _job("probe_pose", {"capture": capture, "optics": None, "calibrations": None},
             {"pose": pose}, **optics, probe=probe, options=config["probe_pose"]),
        _job("force", {"object": raw / "object.yaml", "capture": capture, "pose": pose,
                       "plane": plane, "calibrations": None},
             {"force": force, "clock": out / "clock.json"}, **optics, probe=probe,
             options=config["force"]),
        _job("clouds", alike | {"capture": capture, "optics": None, "mask": mask,
                                "plane": plane}, {"clouds": cloud}, **optics, probe=probe,
             options=config["clouds"], frames=[0]),
        _job("align", alike | {"cloud": cloud, "plane": plane}, {"alignment": alignment},
             probe=probe, options=config["tracking"]["alignment"],
             onset_force_n=config["hertz"]["onset_force_n"]),
        _job("hertz", alike | {"alignment": alignment}, {"fit": out / "hertz.json"}, probe=probe,
             options=config["hertz"]),
    ]  # fmt: skip


def _only(folder: Path, having: str) -> Path:
    """The one folder with a file; mutations may have given it another name."""
    return next(path for path in sorted(folder.iterdir()) if (path / having).is_file())


def _spec(path: Path) -> dict:
    return yaml.safe_load(path.read_text())


def _job(script: str, inputs: Mapping, outputs: Mapping, **params) -> dict:
    return {"script": script, "inputs": inputs, "outputs": outputs, "params": params}


def run_chain(place: Place, kept: Path) -> Path:
    """Run all jobs whose inputs are new; the Hertz fit's file.

    Raises
    ------
    Refused
        With the line that a job ended with.
    """
    for job in jobs(place):
        stored = kept / _key(job, place.folder)
        if not stored.is_dir():
            run_script(job, place.folder / "log.txt")
            _keep(job, stored)
        for name, path in job["outputs"].items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.unlink(missing_ok=True)
            os.link(stored / name, path)
    return job["outputs"]["fit"]


def _keep(job: dict, stored: Path) -> None:
    part = stored.with_name(f"{stored.name}.{os.getpid()}")
    part.mkdir(parents=True)
    for name, path in job["outputs"].items():
        shutil.copy(path, part / name)
    if stored.is_dir():
        shutil.rmtree(part)
    else:
        part.rename(stored)


def run_script(job: dict, log: Path) -> None:
    """Run a script as Snakemake would."""
    inputs = {k: str(v) if v else [] for k, v in job["inputs"].items()}
    snakemake = SimpleNamespace(
        rule=job["script"],
        wildcards=Named(object=OBJECT, sensor=SENSOR, capture=CAPTURE, point="08"),
        log=log.parent / "results" / "log.txt",
        input=Named(**inputs),
        output=Named(**{k: str(v) for k, v in job["outputs"].items()}),
        params=Named(**job["params"]),
    )
    shown, sys.stderr = sys.stderr, io.StringIO()
    try:
        runpy.run_path(str(SCRIPTS / f"{job['script']}.py"), init_globals={"snakemake": snakemake})
    except SystemExit:
        line = [row for row in sys.stderr.getvalue().splitlines() if row.startswith("error: ")]
        raise Refused("\n".join(line)) from None
    finally:
        sys.stderr = shown


def _key(job: dict, base: Path) -> str:
    """Digest of all that a job's result depends on."""
    digest = hashlib.sha256(job["script"].encode())
    digest.update(json.dumps(job["params"], sort_keys=True, default=str).encode())
    for name, path in sorted(job["inputs"].items()):
        digest.update(name.encode())
        for file in filter(READ.get(job["script"], bool), _files(path)):
            digest.update(str(file.relative_to(base)).encode() + file.read_bytes())
    return digest.hexdigest()


def _files(path: Path | None) -> list[Path]:
    if path is None:
        return []
    return [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file())
