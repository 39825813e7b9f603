"""Arrays and images of others: none is unpacked beyond what is allowed."""

from __future__ import annotations

import io
import struct
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable

import numpy as np
import pytest

from mskgrasp.serve.bounded_arrays import MAX_SIDE, read_npz, read_png16
from mskgrasp.serve.rejection import Rejected
from tests.serve.bodies import FRAME, npz, png16

LIMITS = {"depth": MAX_SIDE**2, "intrinsics": 9, "T_base_camera": 7}


def packed(data: bytes, name: str = "depth.npy", **info: int) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, data)
    return file.getvalue()


def png(width: int, height: int, pixels: bytes, *, depth: int = 16, more: tuple[bytes, ...] = ()) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, depth, 0, 0, 0, 0)
    parts = [chunk(b"IHDR", header), *more, chunk(b"IDAT", zlib.compress(pixels)), chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def test_arrays_come_back_as_they_were_written():
    fortran = np.asfortranarray(FRAME.depth.astype(">f8"))
    found = read_npz(npz(depth=fortran), LIMITS)
    np.testing.assert_array_equal(found["depth"], FRAME.depth)
    np.testing.assert_array_equal(found["intrinsics"], FRAME.intrinsics)
    assert found.keys() == LIMITS.keys()


def test_an_image_comes_back_as_it_was_written_and_its_text_is_skipped():
    counts = np.round(FRAME.depth / 1e-4).astype(np.uint16)
    np.testing.assert_array_equal(read_png16(png16()), counts)
    pixels = np.arange(16 * 20, dtype=np.uint16).reshape(16, 20)
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in pixels)
    bomb = chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(10_000_000)))
    np.testing.assert_array_equal(read_png16(png(20, 16, rows, more=(bomb,))), pixels)


def npy(shape: str, data: bytes = b"") -> bytes:
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


@pytest.mark.parametrize("shape", ["(300000000, 0)", "(0, 4)", "(0,)", "(-1, 4)"])
def test_an_array_with_a_side_of_nothing_is_refused(shape: str):
    with pytest.raises(Rejected, match="each of 1 or more") as refused:
        read_npz(packed(npy(shape)), LIMITS)
    assert refused.value.status == 400


def test_a_side_that_is_a_truth_value_is_refused():
    with pytest.raises(Rejected, match=r"shape \(True,\)") as refused:
        read_npz(packed(npy("(True,)", bytes(8))), LIMITS)
    assert refused.value.status == 400


def lying(body: bytes, size: int) -> bytes:
    """The archive, with another unpacked size in both of its headers."""
    at = body.index(b"PK\x01\x02")
    changed = bytearray(body)
    changed[22:26] = changed[at + 24 : at + 28] = struct.pack("<I", size)
    return bytes(changed)


def repeated(body: bytes, n: int) -> bytes:
    """The archive of one array, with that array n times in its directory."""
    at, end = body.index(b"PK\x01\x02"), body.index(b"PK\x05\x06")
    entry, tail = body[at:end], bytearray(body[end:])
    tail[12:16] = struct.pack("<I", n * len(entry))
    return body[:at] + entry * n + bytes(tail)


@pytest.mark.parametrize(
    ("make", "status", "message"),
    [
        (lambda: packed(bytes(300_000_000)), 413, "300000000 bytes unpacked"),
        (lambda: lying(packed(bytes(300_000_000)), 1000), 400, "damaged|header"),
        (lambda: repeated(packed(b"1"), 300_000), 400, "has 300000 arrays"),
        (lambda: repeated(packed(b"1"), 4), 400, "has 4 arrays"),
        (lambda: packed(b"\x93NUMPY\x01\x00" + struct.pack("<H", 60_000) + b" " * 60_000), 400, "no header"),
        (lambda: packed(b"\x93NUMPY\x09\x00" + bytes(100)), 400, "no header"),
        (lambda: packed(b"\x93NUMPY\x01\x00\x0b\x00{'shape':(3" + bytes(100)), 400, "no header"),
        (lambda: packed(b"\x93NUMPY\x01\x00\x0b\x00{['shape']:1" + bytes(100)), 400, "no header"),
    ],
    ids=(
        "bomb",
        "lying bomb",
        "many entries",
        "an entry too many",
        "long header",
        "unknown version",
        "cut literal",
        "unhashable key",
    ),
)
def test_a_bomb_is_refused_without_being_unpacked(make: Callable[[], bytes], status: int, message: str):
    body = make()
    tracemalloc.start()
    with pytest.raises(Rejected, match=message) as refused:
        read_npz(body, LIMITS)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert refused.value.status == status and peak < 80e6


def test_an_array_of_objects_is_refused_before_any_is_made():
    with pytest.raises(Rejected, match="holds object"):
        read_npz(npz(depth=np.array([{}] * 300, dtype=object)), LIMITS)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (png(20_000, 20_000, b""), "20000 x 20000 pixels, at most 2048"),
        (png(100, 100, bytes(50_000_000)), "does not hold the 100 x 100 pixels"),
        (png(100, 100, bytes(100)), "does not hold the 100 x 100 pixels"),
        (png(100, 100, bytes(100 * 101), depth=8), "8 bits"),
        (png16()[:-20], "cut off or damaged"),
        (png16().replace(b"IDAT", b"IDAU", 1), "cut off or damaged"),
        (b"GIF89a", "no PNG image"),
        (b"", "no PNG image"),
        (b"\x89PNG\r\n\x1a\n", "no header"),
    ],
    ids=range(9),
)
def test_an_image_of_another_size_than_its_header_says_is_refused(data: bytes, message: str):
    tracemalloc.start()
    with pytest.raises(Rejected, match=message):
        read_png16(data)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 10e6
