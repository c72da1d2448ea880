"""Results that were damaged after they were made, and who reads them."""

import io
import json
import zipfile
from collections.abc import Callable

import numpy as np

from spoilt.chain import jobs, run_script
from spoilt.place import CAPTURE, OBJECT, SENSOR, Mutation, Place

FOLDER = f"results/{OBJECT}/{SENSOR}"
# A result and the script that reads it.
READERS = {
    f"{FOLDER}/background.npz": "mask",
    f"{FOLDER}/{CAPTURE}/mask.npz": "clouds",
    f"{FOLDER}/{CAPTURE}/rest_cloud.npz": "align",
    f"{FOLDER}/support_plane.json": "align",
    f"{FOLDER}/{CAPTURE}/alignment.json": "hertz",
    f"{FOLDER}/{CAPTURE}/probe_pose.csv": "force",
    f"{FOLDER}/{CAPTURE}/force.csv": "hertz",
}


def reader_of(script: str, place: Place, make: Callable) -> Callable:
    """Make all results, and give what reads the damaged one."""
    make()
    (job,) = [job for job in jobs(place) if job["script"] == script]
    return lambda: run_script(job, place.folder / "log.txt")


def _npy(shape: str, kind: str = "<f8", data: bytes = b"") -> bytes:
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"
    head = text.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode() + data


def _archive(change: Callable[[str, bytes], bytes | None]):
    """Rebuild an NPZ with other members."""

    def apply(content: bytes) -> bytes:
        made = io.BytesIO()
        with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(made, "w") as new:
            for name in old.namelist():
                member = change(name, old.read(name))
                if member is not None:
                    new.writestr(name, member)
        return made.getvalue()

    return apply


def _first_of(content: bytes) -> str:
    return zipfile.ZipFile(io.BytesIO(content)).namelist()[0]


def _without(lost: str) -> Callable[[str, bytes], bytes | None]:
    return lambda name, member: None if name == lost else member


def _pickle(name: str, member: bytes) -> bytes:
    made = io.BytesIO()
    np.save(made, np.array([{"a": print}], dtype=object), allow_pickle=True)
    return made.getvalue()


def _nan(name: str, member: bytes) -> bytes:
    array = np.load(io.BytesIO(member))
    made = io.BytesIO()
    np.save(made, array * np.nan if array.dtype.kind == "f" else array)
    return made.getvalue()


def _shorter(name: str, member: bytes) -> bytes:
    array = np.load(io.BytesIO(member))
    made = io.BytesIO()
    np.save(made, array[: len(array) // 2] if array.ndim else array)
    return made.getvalue()


ARCHIVES = {
    "cut to half": lambda c: c[: len(c) // 2],
    "cut to 30 bytes": lambda c: c[:30],
    "zero bytes": lambda c: b"",
    "text": lambda c: b"nothing of the kind\n",
    "an NPY": lambda c: _npy("(3,)", data=bytes(24)),
    "a pickle": lambda c: b"\x80\x04\x95\x00.",
    "a bit flipped in the middle": lambda c: c[: len(c) // 2]
    + bytes([c[len(c) // 2] ^ 4]) + c[len(c) // 2 + 1 :],
    "no members": _archive(lambda n, m: None),
    "the first member lost": lambda c: _archive(_without(_first_of(c)))(c),
    "pickles inside": _archive(_pickle),
    "shapes of 10^12": _archive(lambda n, m: _npy("(1000000000000,)")),
    "shapes of 10^30": _archive(lambda n, m: _npy(f"({10**30},)")),
    "negative shapes": _archive(lambda n, m: _npy("(-5,)")),
    "texts for numbers": _archive(lambda n, m: _npy("(2,)", "<U1", bytes(8))),
    "headers that call": _archive(lambda n, m: _npy("__import__('os').system('touch escaped')")),
    "NaN for numbers": _archive(_nan),
    "half as many": _archive(_shorter),
}  # fmt: skip
TABLES = {
    "cut to half": lambda c: c[: len(c) // 2],
    "zero bytes": lambda c: b"",
    "header alone": lambda c: c.split(b"\n")[0] + b"\n",
    "binary": lambda c: bytes(range(256)),
    "NaN in a cell": lambda c: c.replace(b"\n4,", b"\n4,nan,", 1),
    "a row lost": lambda c: b"\n".join(c.split(b"\n")[:4] + c.split(b"\n")[5:]),
}
FILES = {
    "cut to half": lambda c: c[: len(c) // 2],
    "zero bytes": lambda c: b"",
    "a list": lambda c: b"[]",
    "null": lambda c: b"null",
    "no fields": lambda c: b"{}",
    "NaN": lambda c: b'{"normal": [NaN, 0, 1], "offset_m": NaN}',
    "texts": lambda c: json.dumps(dict.fromkeys(json.loads(c), "x")).encode(),
    "nested 100000 deep": lambda c: b"[" * 100_000,
    "binary": lambda c: bytes(range(256)),
}


def corpus() -> list[Mutation]:
    """Mutations of results."""
    found = []
    for file, job in READERS.items():
        kinds = {"npz": ARCHIVES, "csv": TABLES, "json": FILES}[file.rpartition(".")[2]]
        for name, change in kinds.items():

            def spoil(place: Place, file=file, change=change) -> None:
                path = place.folder / file
                place.write(path, change(path.read_bytes()))

            short = file.rpartition("/")[2]
            if (short, name) == ("mask.npz", "NaN for numbers"):
                continue  # bits alone
            found.append(Mutation("result", f"{short}: {name}", short, spoil, job=job))
    return found
