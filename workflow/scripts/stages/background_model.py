"""Model the background of one object and sensor."""

from palpate.capture.images import Stream
from palpate.vision.background import build_model, save_model
from palpate.vision.options import Background
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write the four-value model of the reference camera's background."""
    frames = Stream(snakemake.input.background, snakemake.params.sensor)
    options = Background.read(snakemake.params.options)
    with naming(snakemake.input.background, "frame", "background"):
        model = build_model(frames, false_positive_rate=options.false_positive_rate)
    save_model(snakemake.output.model, model)


run(main, snakemake)
