"""Films of a probe by itself, as the stages that calibrate it read them."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.capture.files import whole_file
from palpate.vision.camera import sensor_with_optics
from palpate.vision.follow import board_followed
from palpate.vision.options import ProbePose
from palpate.workflow.job import naming


def film_of_probe(snakemake: Any) -> tuple[Mapping, pd.DataFrame]:
    """Sensor of a film, with its calibrated optics, and where the probe's board is in each frame.

    Parameters
    ----------
    snakemake : object
        The job: ``input.film`` and ``optics``, ``params.sensor``, ``probe`` and ``options``.

    Raises
    ------
    ValueError
        If no probe is said to have been filmed, or as `board_followed` does.
    """
    params, film = snakemake.params, snakemake.input.film
    if params.probe is None:
        raise ValueError("experiments.probe: expected the probe of the film, found none")
    sensor = sensor_with_optics(params.sensor, snakemake.input.get("optics"))
    with naming(film):
        options = ProbePose.read(params.options)
        return sensor, board_followed(film, sensor, params.probe["marker"], options)


def write_calibration(path: str | Path, fields: Mapping) -> None:
    """Write what a film told as JSON, whole or not at all."""
    with whole_file(path) as part:
        part.write_text(json.dumps(fields, indent=1) + "\n", encoding="utf-8")
