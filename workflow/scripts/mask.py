"""Foreground of every frame of a capture."""

import numpy as np
from frames import Stream
from job import run
from palpate.capture.files import whole_file
from palpate.vision.background import classify, load_model


def main(snakemake):
    """Write the packed masks of the reference camera."""
    options = dict(snakemake.params.options)
    options.pop("false_positive_rate")
    model = load_model(snakemake.input.model)
    frames = Stream(snakemake.input.capture, snakemake.params.sensor)
    masks = np.stack([classify(model, image, **options) for image in frames])
    empty = np.flatnonzero(~masks.any(axis=(1, 2)))
    if len(empty):
        raise ValueError(f"mask: expected foreground in each frame, found none in {empty[0]}")
    with whole_file(snakemake.output.mask) as part, part.open("wb") as stream:
        np.savez_compressed(stream, mask=np.packbits(masks, axis=-1), shape=masks.shape)


run(main, snakemake)
