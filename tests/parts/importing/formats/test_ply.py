"""PLY from real bytes; damaged files are refused with the reason."""

import struct

import numpy as np
import pytest
import trimesh
from trimesh.exchange.ply import export_ply

from tests.parts.importing.reading import read, refusal, volume

BOX = trimesh.creation.box((40, 30, 20))


def test_a_ply_that_claims_a_thousand_million_vertices_is_refused_at_once():
    content = bytes(BOX.export(file_type="ply"))
    assert volume(read("box.ply", content)) == pytest.approx(24_000)
    lying = content.replace(b"element vertex 8", b"element vertex 1000000000")
    assert "is not a readable PLY" in refusal("box.ply", lying)


def test_a_ply_too_far_from_its_origin_for_its_numbers_is_refused():
    far = BOX.copy()
    far.apply_translation((1e6, 0, 0))
    for encoding in ("binary", "ascii"):
        content = bytes(export_ply(far, encoding=encoding))
        assert "lies 25,000 times its length from its origin" in refusal("far.ply", content)
    # Text with 64 bits, as the header says, has the digits.
    double = content.replace(b"property float", b"property double")
    assert volume(read("far.ply", double)) == pytest.approx(24_000, rel=1e-6)
    stray = trimesh.Trimesh([*BOX.vertices, [1e6, 0, 0]], BOX.faces, process=False)
    assert volume(read("near.ply", bytes(export_ply(stray)))) == pytest.approx(24_000)


def test_a_ply_of_points_alone_has_no_triangles():
    points = trimesh.PointCloud(BOX.vertices).export(file_type="ply")
    assert "holds no triangles" in refusal("cloud.ply", bytes(points))


ROOF = (
    [(0, 0, 0), (40, 0, 0), (40, 30, 0), (0, 30, 0), (0, 0, 20), (40, 0, 20), (40, 30, 20), (0, 30, 20),
     (20, 15, 40)],
    [[3, 2, 1, 0], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 8], [5, 6, 8], [6, 7, 8],
     [7, 4, 8]],
)  # fmt: skip
"""A box with a pyramid on it, of quads and triangles."""
ROOF_VOLUME = 40 * 30 * 20 + 40 * 30 * 20 / 3
HEADER = """ply
format {format} 1.0
comment a strip of lists is between the vertices and the faces
element vertex {vertices}
property {number} z
property uchar red
property {number} x
property {number} y
element strip 2
property list ushort short pixels
property char kind
element face {faces}
property list uchar float texcoord
property list int {index} {name}
property double weight
end_header
"""


def written(vertices, faces, order: str, number="double", index="uint", name="vertex_index") -> bytes:
    """A PLY in this byte order, or as text, with properties that are to be skipped."""
    formats = {"<": "binary_little_endian", ">": "binary_big_endian", "": "ascii"}
    codes = {"double": "d", "float": "f", "short": "h", "uint": "I", "int": "i", "uchar": "B", "int64": "q"}
    rows: list[tuple[str, tuple[float, ...]]] = [
        ("dBdd".replace("d", codes[number]), (z, 7, x, y)) for x, y, z in vertices
    ]
    rows += [("H3hb", (3, 1, 2, 3, -4)), ("H1hb", (1, 5, -6))]
    for corners in faces:
        code = f"B{2 * len(corners)}fi{len(corners)}{codes[index]}d"
        rows.append((code, (2 * len(corners), *[0.5] * 2 * len(corners), len(corners), *corners, 0.25)))
    header = HEADER.format(
        format=formats[order], vertices=len(vertices), faces=len(faces), number=number, index=index, name=name
    ).encode()
    if not order:
        return header + "\n".join(" ".join(map(str, values)) for _, values in rows).encode()
    return header + b"".join(struct.pack(order + code, *values) for code, values in rows)


@pytest.mark.parametrize("order", ["<", ">", ""])
@pytest.mark.parametrize(
    ("number", "index", "name"),
    [
        ("float", "uchar", "vertex_indices"),
        ("short", "int64", "vertex_index"),
        ("double", "uint", "vertex_index"),
    ],
)
def test_a_ply_of_triangles_and_quads_is_read_in_each_encoding_with_any_types(order, number, index, name):
    content = written(*ROOF, order, number, index, name)
    assert volume(read("roof.ply", content)) == pytest.approx(ROOF_VOLUME)
    windows = content.replace(b"\n", b"\r\n", HEADER.count("\n"))
    assert volume(read("roof.ply", windows)) == pytest.approx(ROOF_VOLUME)


def area(surface) -> float:
    a, b, c = np.moveaxis(surface.triangles, 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


@pytest.mark.parametrize("order", ["<", ">", ""])
@pytest.mark.parametrize(
    ("outline", "section"),
    [
        ([(0, 0), (40, 20), (0, 40), (12, 20)], 560.0),
        ([(0, 0), (60, 0), (60, 30), (50, 30), (50, 10), (10, 10), (10, 30), (0, 30)], 1000.0),
    ],
)
def test_a_concave_polygon_of_a_ply_is_cut_inside_its_outline_wherever_it_begins(order, outline, section):
    n = len(outline)
    around = sum(
        np.hypot(*np.subtract(a, b)) for a, b in zip(outline, outline[1:] + outline[:1], strict=True)
    )
    for first in range(n):
        rim = outline[first:] + outline[:first]
        vertices = [(x, y, z) for z in (0, 12) for x, y in rim]
        faces = [[0, *range(n - 1, 0, -1)], [*range(n, 2 * n)]]
        faces += [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
        file = read("notch.ply", written(vertices, faces, order))
        assert volume(file) == pytest.approx(12 * section)
        assert area(file.objects[0]) == pytest.approx(2 * section + 12 * around)


@pytest.mark.parametrize("order", ["<", ">", ""])
def test_a_damaged_ply_is_refused(order):
    vertices, faces = ROOF
    good = written(*ROOF, order)
    for count in (f"face {len(faces)}", f"vertex {len(vertices)}", "strip 2"):
        for more in ("1", "4000000000", "9" * 30):
            lying = good.replace(f"element {count}".encode(), f"element {count.split()[0]} {more}".encode())
            assert "is not a readable PLY" in refusal("roof.ply", lying)
    assert "is not a readable PLY (it is shorter" in refusal("roof.ply", good[:-30])
    assert "is not a readable PLY (it is longer" in refusal(
        "roof.ply", good + (b"" if order else b" ") + b"1"
    )
    for stranger in (9, -1):
        content = written(vertices, [*faces[:-1], [7, 4, stranger]], order, index="int")
        assert "a face refers to a missing vertex" in refusal("roof.ply", content)
        assert "refers to a missing" in refusal(
            "roof.ply", written(vertices, [[0, 1, 2, stranger]], order, index="int")
        )
    nowhere = written([(np.nan, 0, 0), *vertices[1:]], faces, order)
    assert "not finite" in refusal("roof.ply", nowhere)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (b"double x", b"double u", "no x, y and z"),
        (b"vertex_index", b"corners", "no vertex_indices"),
        (b"double weight", b"quad weight", "'quad'"),
        (b"list ushort short pixels", b"list ushort pixels", "its header has the line 'property list ushort"),
        (b"property list int uint vertex_index", b"property uint vertex_index", "no vertex_indices"),
        (b"double weight", b"double texcoord", "more than once"),
        (b"ascii", b"utf-16", "its header has the line 'format utf-16 1.0'"),
        (b"end_header", b"", "no PLY header"),
        (b"element face 9", b"element face -9", "its header has the line 'element face -9'"),
        (b"6 0.5", b"-6 0.5", "is shorter"),
        (b"6 0.5", b"nan 0.5", "a list of nan numbers"),
        (b"6 0.5", b"x 0.5", "is not a readable PLY"),
    ],
)
def test_a_damaged_header_or_list_of_a_ply_is_named(old, new, said):
    assert said in refusal("roof.ply", written(*ROOF, "").replace(old, new))
