"""Foreground of every frame of a capture."""

import numpy as np
from palpate.capture.files import whole_file
from palpate.run.frames import Stream
from palpate.run.job import naming, run
from palpate.vision.background import load_model
from palpate.vision.foreground import Classifier, save_masks
from palpate.vision.options import Background
from palpate.vision.stillness import check_still

MOST_FOREGROUND = 0.8


def main(snakemake):
    """Write the packed masks of the reference camera."""
    options = Background.read(snakemake.params.options)
    model = load_model(snakemake.input.model)
    with naming(snakemake.input.capture, "mask", "image", "camera"):
        masks = found_masks(snakemake, model, options)
    with whole_file(snakemake.output.mask) as part:
        save_masks(part, masks)


def found_masks(snakemake, model, options):
    """Foreground of each frame, (f, h, w); refused where it can't be the object's."""
    classify = Classifier(
        model,
        alpha_low=options.alpha_low,
        alpha_high=options.alpha_high,
        opening_px=options.opening_px,
        closing_px=options.closing_px,
        smallest_blob_px=options.smallest_blob_px,
    )
    frames = Stream(snakemake.input.capture, snakemake.params.sensor)
    masks = np.stack([classify(image) for image in frames])
    for k in (0, len(masks) - 1):
        check_still(
            model.mean,
            frames[k],
            masks[k],
            largest_shift_px=options.largest_shift_px,
            frame=k,
        )
    full = masks.mean(axis=(1, 2))
    if full.max() > MOST_FOREGROUND:
        raise ValueError(
            f"mask: expected background around the object, found {full.max():.0%} foreground in"
            f" frame {int(full.argmax())} (does the background show the same scene and light?)"
        )
    empty = np.flatnonzero(~masks.any(axis=(1, 2)))
    if len(empty):
        raise ValueError(f"mask: expected foreground in each frame, found none in {empty[0]}")
    return masks


run(main, snakemake)
