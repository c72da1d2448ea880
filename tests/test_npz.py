"""NPZ files that are none, or promise what is not there."""

import zipfile

import numpy as np
import pytest
from palpate.npz import read_npz


def archive(path, member):
    with zipfile.ZipFile(path, "w") as made:
        made.writestr("a.npy", member)


def npy(shape, kind="<f8"):
    head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode()


def test_arrays_come_back(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", a=np.arange(3), b=np.eye(2))
    arrays = read_npz(tmp_path / "a.npz")
    assert list(arrays) == ["a", "b"]
    assert np.array_equal(arrays["b"], np.eye(2))


@pytest.mark.parametrize(
    "member",
    [
        npy("(10**15,)"),
        npy("(-5,)"),
        npy("(3,)"),
        b"text",
    ],
    ids=["sum", "negative", "short", "text"],
)
def test_a_damaged_member(tmp_path, member):
    archive(tmp_path / "a.npz", member)
    with pytest.raises(ValueError, match="a.npz: file: expected an NPZ file of arrays, found none"):
        read_npz(tmp_path / "a.npz")


@pytest.mark.parametrize("content", [b"", b"text", b"PK\x03\x04" + bytes(40), b"\x80\x04\x95."])
def test_a_file_that_is_no_archive(tmp_path, content):
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(ValueError, match="a.npz: file: expected an indentation table, found none"):
        read_npz(tmp_path / "a.npz", what="an indentation table")
