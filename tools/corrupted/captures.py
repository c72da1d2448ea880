"""Entries of what else a capture's folder holds: images, the template, folders and their names."""

import shutil
import struct
import zlib

import cv2
import numpy as np
import trimesh

from corrupted import edits as to
from corrupted.places import BLOCK, COW

KINECT, BACK = f"{BLOCK}/kinect", f"{COW}/bench_cam/back"
CAPTURE = f"{KINECT}/08"


def _chunk(kind, data):
    """One chunk of a PNG file."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _says(width, height, bits=8, colour=0):
    """Another header before the same pixels."""
    head = _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0))
    return to.content(lambda c: c[:8] + head + c[33:])


def _bomb(old):
    """The declared size, and a stream that unpacks to half a gigabyte."""
    packed = zlib.compressobj(9)
    data = b"".join(packed.compress(bytes(1 << 20)) for _ in range(512)) + packed.flush()
    return old[:33] + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")


def _exchanged(one, other):
    def change(path):
        first = (path / one).read_bytes()
        to.write(path / one, (path / other).read_bytes())
        to.write(path / other, first)

    return change


def _of(source):
    """What images of another folder hold that are called the same."""

    def change(path):
        for image in sorted(path.glob("*.png")):
            to.write(image, (path / source / image.name).read_bytes())

    return change


def _grey(image):
    return np.full_like(image, 120)


IMAGE = {
    "lost": to.gone,
    "cut to 30 %": to.cut(0.3),
    "a bit flipped": to.content(to.flipped),
    "says 16 bits": _says(640, 480, bits=16),
    "unpacks to 512 MB": to.content(_bomb),
    "the mosaic filled in": to.pixels(lambda i: cv2.cvtColor(i, cv2.COLOR_BayerBG2BGR)),
    "the one before": to.copied("000003.png"),
    "black": to.pixels(lambda i: i * 0),
    "a pipe": to.pipe,
    "a link to /dev/zero": to.linked("/dev/zero"),
    "a link to itself": to.linked("000004.png"),
}
OF_COLORS = {
    "half the size": to.pixels(lambda i: i[::2, ::2]),
    "mirrored": to.pixels(lambda i: i[:, ::-1]),
    "dark": to.pixels(lambda i: i // 16),
    "first and last exchanged": _exchanged("000000.png", "000009.png"),
}
OF_DEPTHS = {
    "one lost": to.beside("depth/000005.png", to.gone),
    "one in 8 bits": to.beside("depth/000005.png", to.pixels(lambda d: (d >> 3).astype("u1"))),
    "mirrored": to.pixels(lambda d: d[:, ::-1]),
    "zero": to.pixels(lambda d: d * 0),
    "the other byte order": to.pixels(lambda d: d.byteswap()),
    "first and last exchanged": _exchanged("000000.png", "000009.png"),
}
OF_BACKGROUND = {
    "lost": to.gone,
    "three frames": to.beside("background/frames.csv", to.content(
        lambda c: b"\n".join(c.split(b"\n")[:4]) + b"\n")),
    "the capture's colour": to.beside("background/color", _of("../../08/color")),
    "half as bright": to.beside("background/color", to.pixels(lambda i: i // 2)),
    "shifted by 8 px": to.beside("background/color", to.pixels(lambda i: np.roll(i, 8, axis=1))),
}  # fmt: skip


def _promised(element, count):
    """Another number of vertices or faces in the header."""
    begin = f"element {element} ".encode()
    return to.content(lambda c: b"\n".join(
        begin + b"%d" % count if r.startswith(begin) else r for r in c.split(b"\n")))  # fmt: skip


def _of_kind(name, data=None):
    """A template under another name: the same surface, or bytes."""

    def change(path):
        kind = name.rpartition(".")[2]
        made = trimesh.load(path, process=False).export(file_type=kind) if data is None else data
        to.write(path.parent / name, made)
        to.put("template.file", name)(path.parent / "object.yaml")

    return change


def _at(value, index=5):
    return to.vertices(lambda v: np.where(np.arange(len(v))[:, None] == index, value, v))


def _pulled(factor):
    return to.vertices(
        lambda v: v + (np.arange(len(v))[:, None] == 7) * (factor - 1) * (v - v.mean(0))
    )


TEMPLATE = {
    "lost": to.gone,
    "10^12 vertices promised": _promised("vertex", 10**12),
    "a vertex at NaN": _at(np.nan),
    "cutting itself": _pulled(-1.4),
    "in mm": to.vertices(lambda v: v * 1e3),
    "20 mm higher": to.vertices(lambda v: v + [0, 0, 0.02]),
    "upside down": to.vertices(lambda v: v * [1, -1, -1]),
    "on its side": to.vertices(lambda v: v[:, [0, 2, 1]]),
    "a hole": to.faces(lambda f: f[1:]),
    "a face twice": to.faces(lambda f: np.vstack([f, f[:1]])),
    "half the faces turned": to.faces(lambda f: np.vstack([f[::2, ::-1], f[1::2]])),
    "inside out": to.faces(lambda f: f[:, ::-1]),
    "two pieces": to.mesh(lambda v, f: (np.vstack([v, v + [1, 0, 0]]), np.vstack([f, f + len(v)]))),
    "a shell in a shell": to.mesh(lambda v, f: (np.vstack([v, v / 2]), np.vstack([f, f + len(v)]))),
    "STL": _of_kind("template.stl"),
    "an OBJ of /etc/passwd": _of_kind("a.obj", b"mtllib ../../etc/passwd\nv 0 0 0\nf 1 1 1\n"),
}
NAMES = {
    KINECT: {"called kinnect": to.named("kinnect"), "called \\x1b[31m": to.named("\x1b[31m"),
             "no captures": to.beside("kinect/08", to.gone)},
    CAPTURE: {
        "called 99": to.named("99"),
        "called 08-b": to.named("08-b"),
        "called 08 and a newline": to.named("08\n"),
        "called by no UTF-8": to.named("\udc80"),
        "an empty one beside": lambda path: (path.parent / "08.bak").mkdir(),
        "a link to /etc": to.linked("/etc"),
        "a link to itself": to.linked("08"),
        "a link to the background": to.linked("background"),
    },
    BLOCK: {
        "lost": to.gone,
        "a link to it beside": lambda path: (path.parent / "again").symlink_to("foam_block"),
        "an empty folder beside": lambda path: (path.parent / "sponge").mkdir(),
    },
    BACK: {"twice": lambda path: shutil.copytree(path, f"{path}-a02")},
}  # fmt: skip
ENTRIES = NAMES | {
    f"{CAPTURE}/color/000004.png": IMAGE,
    f"{CAPTURE}/color": OF_COLORS,
    f"{CAPTURE}/depth": OF_DEPTHS,
    f"{KINECT}/background": OF_BACKGROUND,
    f"{BLOCK}/template.ply": TEMPLATE,
    f"{BACK}/depth": {"half the size": to.pixels(lambda d: d[::2, ::2])},
    f"{BACK}/color": {
        "the target hidden at the end": to.beside("color/000011.png", to.pixels(_grey))
    },
}
