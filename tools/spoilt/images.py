"""Pictures that are no longer what the camera took."""

# ruff: noqa: E731
import os
import shutil
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np

from spoilt.place import Mutation, Place

SIGNATURE = b"\x89PNG\r\n\x1a\n"
END = b"\x00\x00\x00\x00IEND\xaeB`\x82"


def chunk(kind: bytes, content: bytes) -> bytes:
    """One chunk of a PNG file."""
    checksum = zlib.crc32(kind + content)
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", checksum)


def png(width: int, height: int, bits: int, colour: int, rows: bytes) -> bytes:
    """A PNG of raw rows."""
    head = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    return SIGNATURE + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + END


def _file(place: Place, stream: str, index: int, *, folder: str = "capture") -> Path:
    return getattr(place, folder) / stream / f"{index:06d}.png"


def _bytes(stream, index, change, folder="capture"):
    def spoil(place: Place) -> None:
        path = _file(place, stream, index, folder=folder)
        place.write(path, change(path.read_bytes()))

    return spoil


def _pixels(stream, index, change, folder="capture"):
    def spoil(place: Place) -> None:
        path = _file(place, stream, index, folder=folder)
        image = change(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
        place.write(path, cv2.imencode(".png", image)[1].tobytes())

    return spoil


def _all_pixels(stream, change, folder="capture"):
    def spoil(place: Place) -> None:
        for path in sorted((getattr(place, folder) / stream).glob("*.png")):
            image = change(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
            place.write(path, cv2.imencode(".png", image)[1].tobytes())

    return spoil


def _swap(first: tuple, second: tuple):
    def spoil(place: Place) -> None:
        one, other = _file(place, *first), _file(place, *second)
        content = one.read_bytes()
        place.write(one, other.read_bytes())
        place.write(other, content)

    return spoil


def _link(target: str):
    def spoil(place: Place) -> None:
        path = _file(place, "color", 3)
        path.unlink()
        path.symlink_to(target)

    return spoil


def _folder(place: Place) -> None:
    path = _file(place, "color", 3)
    path.unlink()
    path.mkdir()


def _fifo(place: Place) -> None:
    path = _file(place, "color", 3)
    path.unlink()
    os.mkfifo(path)


def _flip_bit(content: bytes, part: float) -> bytes:
    place = int(len(content) * part)
    return content[:place] + bytes([content[place] ^ 0x10]) + content[place + 1 :]


def _shortened(content: bytes, part: float) -> bytes:
    """Cut, with the end put back, as a clumsy repair leaves it."""
    return content[: int(len(content) * part)] + END


def _header(width: int, height: int, bits: int = 8, colour: int = 0):
    def change(content: bytes) -> bytes:
        head = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
        return SIGNATURE + chunk(b"IHDR", head) + content[33:]

    return change


def _bomb(content: bytes) -> bytes:
    """The declared size, and a stream that unpacks to half a gigabyte."""
    packed = zlib.compressobj(9)
    parts = [packed.compress(bytes(1 << 20)) for _ in range(512)] + [packed.flush()]
    return content[:33] + chunk(b"IDAT", b"".join(parts)) + END


def _note_bomb(content: bytes) -> bytes:
    note = chunk(b"zTXt", b"Comment\x00\x00" + zlib.compress(bytes(64 << 20), 9))
    return content[:33] + note + content[33:]


def corpus() -> list[Mutation]:
    """Mutations of single pictures and of whole streams."""
    found = []

    def add(name: str, file: str, change, **more) -> None:
        found.append(Mutation("picture", name, file, change, **more))

    places = [("color", 0), ("color", 4), ("color", 9), ("depth", 0), ("depth", 5)]
    for stream, index in places:
        file = f"{stream}/{index:06d}.png"
        for part in (0.0, 0.001, 0.3, 0.999):
            cut = lambda c, part=part: c[: int(len(c) * part)]
            add(f"{file} cut to {part:.1%}", file, _bytes(stream, index, cut))
        for part in (0.3, 0.9):
            spoil = lambda c, part=part: _shortened(c, part)
            add(f"{file} cut to {part:.0%}, end put back", file, _bytes(stream, index, spoil))
            flip = lambda c, part=part: _flip_bit(c, part)
            add(f"{file} bit flipped at {part:.0%}", file, _bytes(stream, index, flip))
        for name, text in (("text", b"not a picture"), ("JPEG", b"\xff\xd8\xff\xe0" + bytes(900))):
            add(f"{file} holds {name}", file, _bytes(stream, index, lambda c, t=text: t))
        for width, height in ((1, 1), (640, 481), (2**31 - 1, 2**31 - 1), (65535, 65535), (0, 0)):
            change = _header(width, height, 8 if stream == "color" else 16)
            add(f"{file} says {width} x {height}", file, _bytes(stream, index, change))
        add(f"{file} unpacks to 512 MB", file, _bytes(stream, index, _bomb))
        add(f"{file} with a note of 64 MB", file, _bytes(stream, index, _note_bomb))
    for bits, colour in ((1, 0), (2, 0), (4, 0), (16, 0), (8, 2), (8, 3), (8, 4), (8, 6), (16, 2)):
        change = _header(640, 480, bits, colour)
        name = f"colour says {bits} bits, type {colour}"
        add(name, "color/000002.png", _bytes("color", 2, change))
    add("depth in 8 bits", "depth/000002.png", _pixels("depth", 2, lambda d: (d >> 3).astype("u1")))
    add("every depth in 8 bits", "depth/", _all_pixels("depth", lambda d: (d >> 3).astype("u1")))
    rgb = lambda i: cv2.cvtColor(i, cv2.COLOR_BayerBG2BGR)
    add("one mosaic filled in", "color/000002.png", _pixels("color", 2, rgb))
    add("all mosaics filled in", "color/", _all_pixels("color", rgb))
    rgba = lambda i: cv2.cvtColor(cv2.cvtColor(i, cv2.COLOR_BayerBG2BGR), cv2.COLOR_BGR2BGRA)
    add("with an alpha channel", "color/000002.png", _pixels("color", 2, rgba))
    half = lambda i: np.ascontiguousarray(i[::2, ::2])
    add("half the size", "color/", _all_pixels("color", half))
    add("turned by 180 degrees", "color/", _all_pixels("color", lambda i: i[::-1, ::-1].copy()))
    add("mirrored", "color/", _all_pixels("color", lambda i: i[:, ::-1].copy()))
    add("depth mirrored", "depth/", _all_pixels("depth", lambda i: i[:, ::-1].copy()))
    add("black", "color/000004.png", _pixels("color", 4, lambda i: i * 0))
    add("white", "color/000004.png", _pixels("color", 4, lambda i: i * 0 + 255))
    add("all black", "color/", _all_pixels("color", lambda i: i * 0))
    add("noise", "color/", _all_pixels("color", _noise))
    add("depth of nothing", "depth/000000.png", _pixels("depth", 0, lambda d: d * 0 + 2047))
    add("depth all zero", "depth/", _all_pixels("depth", lambda d: d * 0))
    add("depth of 65535", "depth/", _all_pixels("depth", lambda d: d * 0 + 65535))
    swapped = lambda d: d.byteswap()
    add("depth in the other byte order", "depth/", _all_pixels("depth", swapped))
    add("depth shifted by 3 bits", "depth/", _all_pixels("depth", lambda d: d << 3))
    add("depth off by 40 counts", "depth/", _all_pixels("depth", lambda d: d + 40))
    add("first depth mirrored", "depth/000000.png", _pixels("depth", 0, lambda d: d[:, ::-1]))
    for one, other in (((("color", 0)), ("depth", 0)), (("color", 5), ("depth", 5))):
        add(f"colour and depth {one[1]} swapped", "color/", _swap(one, other))
    for one, other in ((0, 9), (4, 7), (5, 6), (2, 3)):
        add(f"colour {one} and {other} swapped", "color/", _swap(("color", one), ("color", other)))
    for one, other in ((0, 9), (4, 7)):
        swap = _swap(("depth", one), ("depth", other))
        add(f"depth {one} and {other} swapped", "depth/", swap)
    found += _copies() + _links() + _backgrounds()
    return found


def _noise(image):
    return np.random.default_rng(1).integers(0, 255, image.shape).astype(image.dtype)


def _copies() -> list[Mutation]:
    def copied(stream: str, source: int, targets):
        def spoil(place: Place) -> None:
            content = _file(place, stream, source).read_bytes()
            for target in targets:
                place.write(_file(place, stream, target), content)

        return spoil

    cases = [("color", 0, [1]), ("color", 5, [6]), ("color", 6, [7]), ("color", 0, range(10)),
             ("color", 5, [6, 7, 8, 9]), ("depth", 5, [6]), ("depth", 0, range(10)),
             ("depth", 9, [0])]  # fmt: skip
    return [
        Mutation("picture", f"{s} {k} stands for {list(t)}", f"{s}/", copied(s, k, t))
        for s, k, t in cases
    ]


def _links() -> list[Mutation]:
    targets = ["/etc/passwd", "../../../../../etc/hostname", "/dev/zero", "000003.png", "/dev/null",
               "../../../kinect/background/color/000000.png", "nowhere.png", "/proc/self/mem",
               "../../../../../kept"]  # fmt: skip
    found = [Mutation("picture", f"link to {t}", "color/000003.png", _link(t)) for t in targets]
    found.append(Mutation("picture", "a folder", "color/000003.png", _folder))
    found.append(Mutation("picture", "a pipe", "color/000003.png", _fifo))
    return found


def _backgrounds() -> list[Mutation]:
    def of_capture(place: Place) -> None:
        for path in sorted((place.background / "color").glob("*.png")):
            place.write(path, (place.capture / "color" / path.name).read_bytes())

    def depth_of_capture(place: Place) -> None:
        for path in sorted((place.background / "depth").glob("*.png")):
            place.write(path, (place.capture / "depth" / path.name).read_bytes())

    def lost(place: Place) -> None:
        shutil.rmtree(place.background / "color")

    def one(place: Place) -> None:
        content = _file(place, "color", 0, folder="background").read_bytes()
        for path in sorted((place.background / "color").glob("*.png")):
            place.write(path, content)

    dark = _all_pixels("color", lambda i: i // 2, "background")
    shifted = _all_pixels("color", lambda i: np.roll(i, 8, axis=1), "background")
    cases = {
        "frames of the capture": of_capture,
        "depth of the capture": depth_of_capture,
        "colour folder lost": lost,
        "one picture repeated": one,
        "half as bright": dark,
        "shifted by 8 px": shifted,
        "mirrored": _all_pixels("color", lambda i: i[:, ::-1].copy(), "background"),
        "depth of nothing": _all_pixels("depth", lambda d: d * 0 + 2047, "background"),
        "depth mirrored": _all_pixels("depth", lambda d: d[:, ::-1].copy(), "background"),
        "bit flipped": _bytes("color", 2, lambda c: _flip_bit(c, 0.5), "background"),
        "zero bytes": _bytes("depth", 0, lambda c: b"", "background"),
    }
    return [Mutation("background", name, "background/", change) for name, change in cases.items()]
