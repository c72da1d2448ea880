"""Bounds that keep a hostile or damaged bag from taking all memory before it is refused."""

import bz2
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import lz4.frame
from backports import zstd
from rosbags import rosbag1
from rosbags.rosbag1.reader import decompressors
from rosbags.rosbag2 import storage_mcap

# Recorders write chunks of about a megabyte; a chunk or message must fit into memory.
LARGEST_BYTES = 2**28


class BoundedRos1Reader(rosbag1.Reader):
    """Reader that holds what a bag states to the size of its file."""

    index_bytes = 0

    def read_chunk(self) -> Any:
        """Head of a chunk, if the file and memory can hold it."""
        chunk = super().read_chunk()
        held = self.path.stat().st_size - chunk.datapos
        if chunk.datasize > min(held, LARGEST_BYTES):
            found = f"{chunk.datasize} bytes where {held} are left"
            raise rosbag1.ReaderError(f"a chunk of {found} (at most {LARGEST_BYTES})")
        names = [name for name, way in decompressors.items() if way is chunk.decompressor]
        return chunk._replace(decompressor=_ROS1_WAYS[names[0]])

    def read_index_data(self, pos: int, indexes: dict) -> None:
        """Index of a chunk, as long as all of them fit into the file."""
        before = self.bio.tell()
        super().read_index_data(pos, indexes)
        # Chunks that share an index would multiply its entries.
        self.index_bytes += self.bio.tell() - before
        if self.index_bytes > self.path.stat().st_size:
            raise rosbag1.ReaderError("an index larger than the file")


def check_chunks(path: Path, reader: Any) -> None:
    """Refuse chunks that state to be larger than what fits into memory, alone or side by side."""
    storages = getattr(reader.storage, "storages", [reader.storage])
    chunks = [chunk for storage in storages for chunk in getattr(storage, "chunks", [])]
    turns = [(chunk.message_start_time, 1, chunk.uncompressed_size) for chunk in chunks]
    ends = [max(chunk.message_start_time, chunk.message_end_time) for chunk in chunks]
    turns += [(end, 2, -chunk.uncompressed_size) for end, chunk in zip(ends, chunks, strict=True)]
    open_bytes = 0
    for _, _, size in sorted(turns):
        open_bytes += size
        if open_bytes > LARGEST_BYTES:
            expected = f"at most {LARGEST_BYTES} bytes of messages at one time"
            raise ValueError(f"{path}: chunks: expected {expected}, found {open_bytes}")


@contextmanager
def bounded_chunks() -> Iterator[None]:
    """Let MCAP's chunks unpack to the largest allowed size and no further."""
    usual = dict(storage_mcap.DECOMPRESSORS)
    storage_mcap.DECOMPRESSORS.update(_MCAP_WAYS)
    try:
        yield
    finally:
        storage_mcap.DECOMPRESSORS.update(usual)


def _unpacking(machine: Callable[[], Any]) -> Callable[..., bytes]:
    """Decompress all of some data, or refuse it as soon as it gets too large."""

    def unpacked(data: bytes, *_: int) -> bytes:
        one = machine()
        content = one.decompress(data, LARGEST_BYTES + 1)
        if len(content) > LARGEST_BYTES or not one.eof:
            raise ValueError(f"a chunk that is cut or unpacks to more than {LARGEST_BYTES} bytes")
        return content

    return unpacked


_ROS1_WAYS = {
    "none": bytes,
    "bz2": _unpacking(bz2.BZ2Decompressor),
    "lz4": _unpacking(lz4.frame.LZ4FrameDecompressor),
}
_MCAP_WAYS = {
    "lz4": _unpacking(lz4.frame.LZ4FrameDecompressor),
    "zstd": _unpacking(zstd.ZstdDecompressor),
}
