"""Figure 4.11: colour model of the background subtraction for one captured pixel."""

import numpy as np
from frames import Stream
from job import run
from palpate.capture.files import whole_file
from palpate.study import colour_model, colour_pixel, style
from palpate.vision.background import load_model
from palpate.vision.foreground import load_masks


def main(snakemake):
    """Choose a pixel of the capture's middle frame and draw the figure."""
    inputs, params = snakemake.input, snakemake.params
    bounds = params.options["alpha_low"], params.options["alpha_high"]
    model, frames = load_model(inputs.model), Stream(inputs.capture, params.sensor)
    middle = len(frames) // 2
    image, mask = frames[middle], load_masks(inputs.mask)[middle]
    pixel = colour_pixel.choose_pixel(model, image, mask, alpha_low=bounds[0])
    samples = np.stack([frame[pixel] for frame in Stream(inputs.background, params.sensor)])
    shown = colour_pixel.pixel_colour(model, image, samples, pixel)
    with style.journal():
        figure = colour_model.figure_4_11(
            shown, image, pixel, alpha_bounds=bounds, provenance=params.capture["provenance"]
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
