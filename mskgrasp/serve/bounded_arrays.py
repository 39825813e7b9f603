"""Arrays of untrusted npz files and PNG images: sizes are checked before anything is decompressed."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping

import cv2
import numpy as np
from numpy.lib import format as npy

from mskgrasp.core.array_files import BAD_HEADER
from mskgrasp.serve.rejection import Rejected

MIN_SIDE = 16
"""Fewest pixels along a side of an image."""
MAX_SIDE = 2048
"""Most pixels along a side of an image."""
_NPY_HEADER = 1024
"""Room for the header of an array, bytes: numpy writes 128."""
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, RuntimeError, ValueError)
"""What zipfile raises for files that are cut off or changed; NotImplementedError is a RuntimeError."""
_ENTRY = b"PK\x01\x02"
"""Start of each entry in the directory of a zip file."""
_KEPT_CHUNKS = (b"IHDR", b"IDAT", b"IEND")


def read_npz(body: bytes, max_items: Mapping[str, int]) -> dict[str, np.ndarray]:
    """Read an npz file of plain numbers.

    Args:
        body: The file.
        max_items: Legal names, with the most numbers that an array may hold.

    Raises:
        Rejected: It is no such file, has another array, or one of objects, text or too many numbers.
    """
    # Before zipfile makes an object of each of a million entries; a few more may occur in the data by chance.
    if (n := body.count(_ENTRY)) > len(max_items) + 100:
        raise Rejected(400, f"the npz file has {n} arrays; legal: {', '.join(max_items)}")
    try:
        with zipfile.ZipFile(io.BytesIO(body)) as archive:
            return _read_members(archive, max_items)
    except _DAMAGE as error:
        raise Rejected(400, f"the npz file is damaged ({error}); write it with numpy.savez") from error


def _read_members(archive: zipfile.ZipFile, max_items: Mapping[str, int]) -> dict[str, np.ndarray]:
    legal = ", ".join(max_items)
    members = archive.infolist()
    if len(members) > len(max_items):
        raise Rejected(400, f"the npz file has {len(members)} arrays; legal: {legal}")
    found: dict[str, np.ndarray] = {}
    for member in members:
        name = member.filename.removesuffix(".npy")
        if name not in max_items or name in found or not member.filename.endswith(".npy"):
            raise Rejected(
                400, f"the npz file has the unknown or repeated array {name[:40]!r}; legal: {legal}"
            )
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise Rejected(400, f"array {name}: unknown compression; write it with numpy.savez_compressed")
        most = 8 * max_items[name] + _NPY_HEADER
        if member.file_size > most:
            raise Rejected(413, f"array {name} has {member.file_size} bytes unpacked, at most {most}")
        with archive.open(member) as file:
            # The size that the file states may be a lie: no more than allowed is unpacked.
            data = file.read(most + 1)
        if len(data) > most:
            raise Rejected(413, f"array {name} has more than {most} bytes unpacked; send a smaller one")
        found[name] = _array(name, data, max_items[name])
    return found


def _array(name: str, data: bytes, most: int) -> np.ndarray:
    """Decode a npy file; its header is evaluated as literals only, and no object is made of it."""
    file = io.BytesIO(data)
    try:
        version = npy.read_magic(file)
        read = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}[version]
        shape, fortran, dtype = read(file, max_header_size=_NPY_HEADER)
    except (*BAD_HEADER, KeyError, RecursionError, MemoryError) as error:
        raise Rejected(400, f"array {name} has no header of numpy's; write it with numpy.savez") from error
    if (
        dtype.kind not in "fiu" or dtype.itemsize > 8 or dtype == np.float16
    ):  # which has steps of 0.5 mm at 0.8 m
        raise Rejected(400, f"array {name} holds {dtype}; send float32, float64 or integers")
    # With a side of 0 the product bounds no other side, and a list of it would have an entry for each row.
    if len(shape) > 2 or any(type(side) is not int or side < 1 for side in shape):  # numpy reads True, too
        raise Rejected(
            400, f"array {name} has shape {shape}; send one of two dimensions at most, each of 1 or more"
        )
    n = int(np.prod(shape, dtype=object))
    rest = data[file.tell() :]
    if n > most:
        raise Rejected(413, f"array {name} has {n} numbers, at most {most} are taken; send a smaller one")
    if n * dtype.itemsize != len(rest):
        raise Rejected(400, f"array {name} is cut off: {len(rest)} bytes for shape {shape} of {dtype}")
    return (
        np.frombuffer(rest, dtype)
        .reshape(shape, order="F" if fortran else "C")
        .astype(dtype.newbyteorder("="))
    )


def read_png16(data: bytes) -> np.ndarray:
    """Decode a grey PNG of 16 bits, not interlaced.

    Returns:
        (h, w) uint16.

    Raises:
        Rejected: It is no such image, damaged, or larger than `MAX_SIDE` squared.
    """
    chunks = _chunks(data)
    names = [name for name, _, _ in chunks]
    if (
        names[:1] != [b"IHDR"]
        or names[-1:] != [b"IEND"]
        or names.count(b"IHDR") != 1
        or len(chunks[0][1]) != 13
    ):
        raise Rejected(400, "the PNG image is damaged: it has no header or no end; encode it again")
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", chunks[0][1])
    if (depth, colour, interlaced) != (16, 0, 0):
        raise Rejected(
            400, f"the PNG image has {depth} bits and colour type {colour}; send 16 bits grey, not interlaced"
        )
    check_shape((height, width))
    size = height * (1 + 2 * width)
    try:
        unpacker = zlib.decompressobj()
        pixels = unpacker.decompress(b"".join(part for name, part, _ in chunks if name == b"IDAT"), size + 1)
    except zlib.error as error:
        raise Rejected(400, f"the PNG image is damaged ({error}); encode it again") from error
    if len(pixels) != size:
        raise Rejected(400, f"the PNG image does not hold the {width} x {height} pixels of its header")
    # Text and profiles, which may be compressed too, do not reach the decoder.
    plain = _PNG_SIGNATURE + b"".join(whole for name, _, whole in chunks if name in _KEPT_CHUNKS)
    try:
        image = cv2.imdecode(np.frombuffer(plain, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None or image.dtype != np.uint16 or image.shape != (height, width):
        raise Rejected(400, "the PNG image cannot be decoded; encode it again")
    return image


def _chunks(data: bytes) -> list[tuple[bytes, bytes, bytes]]:
    """Split a PNG into name, data and whole of each chunk, with checked sums.

    Raises:
        Rejected: It is no PNG, or damaged.
    """
    if not data.startswith(_PNG_SIGNATURE):
        raise Rejected(400, "depth_png is no PNG image; encode 16 bits grey as PNG, then as base64")
    found, place = [], len(_PNG_SIGNATURE)
    while place < len(data):
        length, name = struct.unpack(">I4s", data[place : place + 8].ljust(8, b"\0"))
        end = place + 12 + length
        if end > len(data) or zlib.crc32(data[place + 4 : end - 4]) != int.from_bytes(
            data[end - 4 : end], "big"
        ):
            raise Rejected(400, "the PNG image is cut off or damaged; encode it again")
        found.append((name, data[place + 8 : end - 4], data[place:end]))
        place = end
    return found


def check_shape(shape: tuple[int, ...]) -> None:
    """Refuse the shape of an image that is not taken.

    Raises:
        Rejected: It has not two sides, or one outside `MIN_SIDE` .. `MAX_SIDE`.
    """
    if len(shape) != 2:
        raise Rejected(400, f"depth has shape {shape}; send (h, w)")
    if max(shape) > MAX_SIDE:
        raise Rejected(
            413, f"depth has {shape[0]} x {shape[1]} pixels, at most {MAX_SIDE} a side; send a part of it"
        )
    if min(shape) < MIN_SIDE:
        raise Rejected(400, f"depth has {shape[0]} x {shape[1]} pixels, at least {MIN_SIDE} a side")
