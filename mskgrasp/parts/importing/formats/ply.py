"""PLY, binary and text: vertices and polygons; colours, normals and everything else are skipped.

Our own reader: trimesh's cuts concave polygons into fans that fold over themselves, and refuses binary files
whose polygons differ in their number of corners.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from mskgrasp.parts.importing.formats import Loaded, Unreadable
from mskgrasp.parts.importing.formats.float32 import check_resolution
from mskgrasp.parts.importing.formats.polygons import triangulated
from mskgrasp.parts.solids.surface import Surface

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float16": "f2", "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
_INDICES = ("vertex_indices", "vertex_index")
_FORMS = ([], 0), (["list"], 2)
"""First word and number of words between ``property`` and its type: of a number and of a list."""


@dataclass(frozen=True, kw_only=True)
class _Property:
    """A number of each row, or a list.

    Attributes:
        name: As in the header.
        kind: Type that the header states.
        stored: Type of what is read: that, or float64 for the numbers of a text.
        size: Type in which the length of a list is stored; None for a number.
    """

    name: str
    kind: np.dtype
    stored: np.dtype
    size: np.dtype | None


@dataclass(frozen=True, kw_only=True)
class _Element:
    """Rows of one kind."""

    count: int
    properties: list[_Property]


@dataclass(frozen=True, kw_only=True)
class _Column:
    """A property of all rows: their values one after another, and (n,) how many each row has."""

    values: np.ndarray
    sizes: np.ndarray


def load_ply(content: bytes) -> Loaded:
    """Read a PLY; its unit is unknown. Polygons are triangulated.

    Raises:
        Unreadable: It is damaged, holds only points, or is too far from its origin.
    """
    try:
        with np.errstate(all="ignore"):  # numbers that are not finite are refused later, as in all formats
            surface, kind, n_lines = _surface(content)
    except (ValueError, KeyError) as error:
        raise Unreadable(f"is not a readable PLY ({str(error)[:80]}): export or copy it again") from error
    if kind.itemsize == 4:
        check_resolution([surface])
    notes = (f"left out {n_lines} polygons of fewer than three corners",) if n_lines else ()
    return Loaded(objects=(surface,), notes=notes)


def _surface(content: bytes) -> tuple[Surface, np.dtype, int]:
    """The triangles, the type of their coordinates, and how many polygons are points or lines."""
    elements, is_text, start = _header(content)
    vertex, face = elements.get("vertex"), elements.get("face")
    if vertex is None or face is None or not vertex.count or not face.count:
        raise Unreadable("holds no triangles (a point cloud?): export it from the CAD program as a mesh")
    # Where a face has nothing else, its list is that of the corners, whatever the name.
    names = [item.name for item in face.properties if item.size]
    index = next(
        (name for name in _INDICES if name in names),
        names[0] if names and len(face.properties) == 1 else None,
    )
    kinds = {item.name: item.kind for item in vertex.properties}
    if index is None or not {"x", "y", "z"} <= kinds.keys():
        raise ValueError("no x, y and z of its vertices, or no vertex_indices of its faces")
    body = memoryview(content)[start:]
    if is_text:
        body = memoryview(np.fromstring(body.tobytes().strip(), sep=" ").tobytes())
    at, columns = 0, dict[str, dict[str, _Column]]()
    for name, element in elements.items():
        columns[name], at = _read(body, at, element)
    if at != len(body):
        raise ValueError("it is longer than its header states")
    axes = [columns["vertex"][axis].values.astype(kinds[axis]).astype(np.float64) for axis in "xyz"]
    points = np.stack(axes, axis=1)
    polygons = columns["face"][index]
    surface = Surface(vertices=points, faces=_triangles(points, polygons))
    return surface, kinds["x"], int((polygons.sizes < 3).sum())


def _header(content: bytes) -> tuple[dict[str, _Element], bool, int]:
    """Elements by name in the file's order, whether it is text, and where the header ends."""
    end = re.search(rb"\n[ \t]*end_header[ \t]*(\r?\n|$)", content)
    lines = content[: end.start()].decode("ascii", "replace").splitlines() if end else []
    if end is None or lines[0].strip().lower() != "ply":
        raise ValueError("no PLY header")
    encoding, elements = "", dict[str, _Element]()
    for line in lines[1:]:
        match line.split():
            case ["format", name, _] if name in _ORDERS:
                encoding = name
            case ["element", name, count] if count.isdecimal() and name not in elements:
                elements[name] = _Element(count=int(count), properties=[])
            case ["property", *lists, kind, name] if (
                encoding and elements and (lists[:1], len(lists)) in _FORMS
            ):
                kinds = [np.dtype(_ORDERS[encoding] + _TYPES[one]) for one in (kind, *lists[1:])]
                stored = [np.dtype("f8")] * len(kinds) if encoding == "ascii" else kinds
                size = stored[1] if lists else None
                list(elements.values())[-1].properties.append(
                    _Property(name=name, kind=kinds[0], stored=stored[0], size=size)
                )
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise ValueError(f"its header has the line {line.strip()[:40]!r}")
    return elements, encoding == "ascii", end.end()


def _read(body: memoryview, at: int, element: _Element) -> tuple[dict[str, _Column], int]:
    """The columns of an element that begins at a byte, and where it ends."""
    if not element.count or not element.properties:
        return {}, at
    first, _ = _read_rows(body, at, element, 1)
    fields = []
    for item in element.properties:
        length = int(first[item.name].sizes[0])
        fields += [(f"size of {item.name}", item.size)] if item.size else []
        fields.append((item.name, item.stored, (length,)))
    row = np.dtype(fields)
    end = at + element.count * row.itemsize
    if end > len(body):  # or lists of the other rows are shorter, and the rows end in time
        return _read_rows(body, at, element, element.count)
    rows = np.frombuffer(body, row, element.count, at)
    lists = [item.name for item in element.properties if item.size]
    if not all((rows[f"size of {name}"] == row[name].shape[0]).all() for name in lists):
        return _read_rows(body, at, element, element.count)
    return {
        item.name: _Column(
            values=rows[item.name].reshape(-1), sizes=np.full(element.count, row[item.name].shape[0])
        )
        for item in element.properties
    }, end


def _read_rows(body: memoryview, at: int, element: _Element, count: int) -> tuple[dict[str, _Column], int]:
    """The same of the first rows, one by one: their lists may differ in length."""
    found: dict[str, list[np.ndarray]] = {item.name: [] for item in element.properties}
    for _ in range(count):
        for item in element.properties:
            length = 1
            if item.size:
                stated = float(_numbers(body, at, item.size, 1)[0])
                if not stated.is_integer():
                    raise ValueError(f"it has a list of {stated:g} numbers")
                length, at = int(stated), at + item.size.itemsize
            found[item.name].append(_numbers(body, at, item.stored, length))
            at += length * item.stored.itemsize
    return {
        name: _Column(values=np.concatenate(values), sizes=np.array([len(value) for value in values]))
        for name, values in found.items()
    }, at


def _numbers(body: memoryview, at: int, kind: np.dtype, count: int) -> np.ndarray:
    """Numbers (count,) that begin at a byte."""
    end = at + count * kind.itemsize
    if not at <= end <= len(body):
        raise ValueError("it is shorter than its header states")
    return np.frombuffer(body[at:end], kind)


def _triangles(points: np.ndarray, column: _Column) -> np.ndarray:
    """Triangles (m, 3) of polygons: those of three corners first, then of four, then the others."""
    corners, sizes = column.values.astype(np.int64), column.sizes
    if (sizes == 3).all():
        return corners.reshape(-1, 3)
    start = np.cumsum(sizes) - sizes
    triangles, quads = (corners[start[sizes == n, None] + np.arange(n)] for n in (3, 4))
    halves = quads[:, [0, 1, 2]], quads[:, [2, 3, 0]]
    folded = np.zeros(len(quads), dtype=bool)
    if len(corners) and corners.min() >= 0 and corners.max() < len(points):
        # Most quads are convex: the others are found at once, as in `triangulated`.
        rim = points[quads[:, 1:]] - points[quads[:, :1]]
        normals = np.cross(rim[:, :-1], rim[:, 1:])
        folded = (np.einsum("ijk,ik->ij", normals, normals.sum(axis=1)) < 0).any(axis=1)
    others = [*quads[folded], *(corners[at : at + n] for at, n in zip(start, sizes, strict=True) if n > 4)]
    return np.concatenate(
        [triangles, *(half[~folded] for half in halves), *(triangulated(points, other) for other in others)]
    )
