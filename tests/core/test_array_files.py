"""Files of arrays are read back equal, anything else is refused in one line."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from numpy.lib import format as npy

from mskgrasp.core.array_files import read_arrays, write_arrays


def test_arrays_are_read_back_equal(tmp_path: Path):
    arrays = {"a": np.arange(6).reshape(2, 3), "b": np.array(1.5, np.float32), "c": np.zeros(0)}
    write_arrays(tmp_path / "one.npz", **arrays)
    again = read_arrays(tmp_path / "one.npz")
    assert list(again) == list(arrays)
    for name, value in arrays.items():
        np.testing.assert_array_equal(again[name], value)
        assert again[name].dtype == value.dtype
    assert [path.name for path in tmp_path.iterdir()] == ["one.npz"]


def test_what_is_no_archive_of_arrays_is_a_value_error_of_one_line(tmp_path: Path):
    path = tmp_path / "one.npz"
    write_arrays(path, a=np.random.default_rng(0).uniform(size=1000))
    whole = path.read_bytes()
    flipped = whole[:200] + bytes(byte ^ 0xFF for byte in whole[200:300]) + whole[300:]
    method = bytearray(whole)
    method[8] = method[whole.rindex(b"PK\x01\x02") + 10] = 99  # an unknown compression
    encrypted = bytearray(whole)
    encrypted[whole.rindex(b"PK\x01\x02") + 8] |= 1
    damaged = (b"", whole[: len(whole) // 2], flipped, bytes(method), bytes(encrypted), b"\x80\x04N.")
    for content in damaged:
        path.write_bytes(content)
        with pytest.raises(ValueError) as raised:
            read_arrays(path)
        assert str(raised.value) and "\n" not in str(raised.value)
    np.savez(path, allow_pickle=True, a=np.array([{}], dtype=object))
    with pytest.raises(ValueError, match="objects in place of numbers"):
        read_arrays(path)
    with pytest.raises(OSError):
        write_arrays(tmp_path / "none" / "one.npz", a=np.zeros(1))
    with pytest.raises(ValueError):
        write_arrays(path, a=np.array([{}], dtype=object))


@pytest.mark.parametrize(
    "header", ["{'descr': '<f8', 'shape': (3,", "{['a']: 1, 'descr': '<f8', 'shape': (3,)}"]
)
def test_a_header_that_is_no_literal_is_a_value_error_of_one_line(tmp_path: Path, header: str):
    with zipfile.ZipFile(tmp_path / "one.npz", "w") as file:
        text = header.encode() + b"\n"
        file.writestr("a.npy", b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text)
    with pytest.raises(ValueError, match="cut off") as raised:
        read_arrays(tmp_path / "one.npz")
    assert "\n" not in str(raised.value)


def test_an_array_that_claims_to_be_larger_than_the_memory_is_a_value_error(tmp_path: Path):
    header = io.BytesIO()
    npy.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**15,)})
    with zipfile.ZipFile(tmp_path / "one.npz", "w") as file:
        file.writestr("a.npy", header.getvalue())
    with pytest.raises(ValueError, match="larger than the memory"):
        read_arrays(tmp_path / "one.npz")
