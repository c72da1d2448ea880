"""What the parts of ``palpate calibrate`` about the probe share: poses, and what is told."""

import argparse
import json
from collections.abc import Mapping
from math import floor, inf, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.capture.tables import FRAMES

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from pandas import DataFrame

# Of a probe's file, beside its board.
TRANSFORMS = ("marker_from_force", "force_from_tip")


def add_film(verb: argparse.ArgumentParser) -> None:
    """Add the poses, and what a film needs to give them."""
    verb.add_argument("source", type=Path, metavar="POSES", help="film, table or folder of poses")
    add_devices(verb)


def add_devices(verb: argparse.ArgumentParser) -> None:
    """Add the files of what a film shows."""
    verb.add_argument("--sensor", type=Path, metavar="FILE", help="of a film: the sensor's YAML")
    verb.add_argument(
        "--board",
        type=Path,
        metavar="FILE",
        help="YAML with a block marker, as palpate board prints or a probe's file has",
    )


def poses_of(options: argparse.Namespace) -> tuple[list[str], "NDArray", list[str], Mapping]:
    """Names of the poses, poses camera_from_marker (n, 4, 4), names of those that were lost.

    And the file that has the board.

    Raises
    ------
    ValueError
        If there are none, or what a film needs is not given.
    """
    from palpate.vision.pose_files import read_poses
    from palpate.vision.probe import marker_transforms

    source = options.source
    if not source.exists():
        raise ValueError(f"{source}: source: expected a film, a table or a folder, found none")
    probe = {} if options.board is None else board_file(options.board)
    if not (source / FRAMES).is_file():
        return *read_poses(source, options.unit), probe
    needed(options, "sensor", "board")
    table = film_table(source, sensor_file(options.sensor), probe["marker"])
    return [f"frame {k}" for k in table["frame"]], marker_transforms(table), [], probe


def needed(options: argparse.Namespace, *names: str) -> None:
    """Refuse a film without the files of what it shows.

    Raises
    ------
    ValueError
    """
    for name in names:
        if getattr(options, name) is None:
            expected = f"the file of what {options.source} shows"
            raise ValueError(f"--{name}: expected {expected}, found none")


def film_table(
    source: Path, sensor: Mapping, marker: Mapping, *, force: bool = False
) -> "DataFrame":
    """Poses of the board in the frames of a film that show it; with a record of forces or without.

    Raises
    ------
    ValueError
        With a line for each thing that is wrong.
    """
    from palpate.capture.check import check_capture
    from palpate.capture.experiments import check_film
    from palpate.vision.follow import board_followed
    from palpate.vision.options import ProbePose

    if lines := (check_capture if force else check_film)(source, sensor):
        raise ValueError("\n".join(lines))
    try:
        return board_followed(source, sensor, marker, ProbePose())
    except ValueError as error:
        said = str(error).startswith(str(source))
        raise ValueError(f"{'' if said else f'{source}: '}{error}") from None


def sensor_file(path: Path) -> Mapping:
    """A sensor's file whose optics are stated."""
    from palpate.capture.devices import read_device

    spec, wrong = read_device(path, "sensors")
    if wrong:
        raise ValueError("\n".join(wrong))
    if spec.get("optics") == "calibration":
        expected = "stated optics (a run calibrates them and the tip together)"
        raise ValueError(f"{path}: optics: expected {expected}, found calibration")
    return spec


def board_file(path: Path) -> Mapping:
    """A file with a block ``marker``; name, transforms and ``gauge`` where filled in.

    Raises
    ------
    ValueError
        If one of them is wrong.
    """
    from palpate.config.model import blank_fields, problems
    from palpate.config.probe import ProbeSpec, TargetFile
    from palpate.workflow.options import partly
    from palpate.yaml_files import load_yaml

    content = load_yaml(path)
    if not isinstance(content, Mapping):
        raise ValueError(f"{path}: content: expected a block marker, found none")
    board = {"marker": content["marker"]} if "marker" in content else dict(content)
    TargetFile.read(board, str(path))
    filled = {
        key: content[key]
        for key in ("probe", *TRANSFORMS, "gauge")
        if key in content and not blank_fields(content[key])
    }
    if lines := problems(partly(ProbeSpec), filled, str(path)):
        raise ValueError("\n".join(lines))
    return TargetFile.plain(board) | filled


def check_output(output: Path | None, *sources: Path) -> None:
    """Refuse to write over what is read, or over a folder.

    Raises
    ------
    ValueError
    """
    if output is None:
        return
    if output.is_dir() or not output.parent.is_dir():
        found = "a folder" if output.is_dir() else "a folder that is not there"
        raise ValueError(f"--output: expected a file, found {found}: {output}")
    if output.resolve() in {source.resolve() for source in sources}:
        raise ValueError(f"--output: expected a file of its own, found {output} in use already")


def write_json(path: Path, fields: Mapping[str, Any]) -> None:
    """Write a JSON file, whole or not at all, and say so."""
    from palpate.capture.files import write_text

    write_text(path, json.dumps(fields, indent=1) + "\n")
    print(f"written: {path}")


def sure(value: float, error: float) -> str:
    """A value to the second digit of its standard error."""
    digits = max(0, 1 - floor(log10(error))) if 0 < error < inf else 6
    return f"{value:.{digits}f} +- {error:.{digits}f}"
