"""Model the background of one object and sensor."""

from palpate.capture.files import whole_file
from palpate.capture.streams import Stream
from palpate.vision.background import build_model, save_model
from palpate.vision.options import Background
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write the four-value model of the reference camera's background."""
    frames = Stream(snakemake.input.background, snakemake.params.sensor)
    options = Background.read(snakemake.params.options)
    with naming(snakemake.input.background, "frame", "background"):
        model = build_model(frames, false_positive_rate=options.false_positive_rate)
    with whole_file(snakemake.output.model) as part:
        save_model(part, model)


run(main, snakemake)
