"""Images of a folder, one frame at a time."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from numpy.typing import NDArray

from palpate.capture.images import read_image, read_samples
from palpate.capture.tables import STREAMS, image_streams, read_frames


class Stream(Sequence):
    """Lazy sequence of one stream's images; each is read when it is asked for.

    Parameters
    ----------
    folder : path
        Folder of a capture or a background.
    sensor : mapping
        The sensor's file.
    stream : str, optional
        Name of the stream; the reference camera's by default.
    samples : bool, optional
        Whether mosaics stay as the camera sampled them.
    """

    def __init__(
        self,
        folder: str | Path,
        sensor: Mapping,
        stream: str | None = None,
        *,
        samples: bool = False,
    ) -> None:
        self.folder, self.read = Path(folder), read_samples if samples else read_image
        stream = stream or STREAMS[sensor["kind"]][0]
        self.files = [str(name) for name in read_frames(folder)[stream]]
        self.encoding = image_streams(sensor)[stream]["encoding"]

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, index: int) -> NDArray:
        return self.read(self.folder / self.files[index], self.encoding)


def all_streams(
    folder: str | Path, sensor: Mapping, chosen: Sequence[int] | None = None
) -> Iterator[dict[str, NDArray]]:
    """Images of all streams, frame by frame: of the chosen frames, or of all."""
    streams = {name: Stream(folder, sensor, name) for name in image_streams(sensor)}
    count = len(next(iter(streams.values())))
    for k in range(count) if chosen is None else chosen:
        yield {name: stream[k] for name, stream in streams.items()}
