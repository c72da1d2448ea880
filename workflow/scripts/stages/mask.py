"""Foreground of every frame of a capture."""

from palpate.capture.images import Stream
from palpate.vision.background import load_model
from palpate.vision.foreground import masks_of, save_masks
from palpate.vision.options import Background
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write the packed masks of the reference camera."""
    frames = Stream(snakemake.input.capture, snakemake.params.sensor)
    model = load_model(snakemake.input.model)
    with naming(snakemake.input.capture, "mask", "image", "camera"):
        masks = masks_of(frames, model, Background.read(snakemake.params.options))
        save_masks(snakemake.output.mask, masks)


run(main, snakemake)
