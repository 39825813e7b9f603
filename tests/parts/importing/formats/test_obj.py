"""OBJ from real bytes; damaged files are refused with the reason."""

import numpy as np
import pytest
import trimesh

from tests.parts.importing.reading import read, refusal, volume

BOX = trimesh.creation.box((40, 30, 20))


CUBE_OBJ = """\
v 0 0 0
v 10 0 0
v 10 10 0
v 0 10 0
v 0 0 10
v 10 0 10
v 10 10 10
v 0 10 10
f 4 3 2 1
f 5/1/1 6/2/1 7/3/1 8/4/1
f -8 -7 -3 -4
f 2 3 7 6
f 3 4 8 \\
7
f 4 1 5 8
"""


def test_polygons_textures_backward_counts_and_continued_lines_of_an_obj_are_understood():
    assert volume(read("cube.obj", CUBE_OBJ.encode())) == pytest.approx(1000)
    assert volume(read("cube.obj", CUBE_OBJ.replace("\n", "\r\n").encode())) == pytest.approx(1000)


def test_backward_counts_of_an_obj_are_from_the_vertex_read_last():
    pieces = "".join(
        "".join(f"v {x} {y} {z}\n" for x, y, z in triangle) + "f -3 -2 -1\n" for triangle in BOX.triangles
    )
    assert volume(read("box.obj", pieces.encode())) == pytest.approx(24_000)


def test_a_concave_polygon_of_an_obj_is_cut_inside_its_outline():
    outline = [(0, 0), (40, 0), (40, 40), (22, 40), (20, 5), (18, 40), (0, 40)]
    n = len(outline)
    lines = [f"v {x} {y} {z}" for z in (0, 10) for x, y in outline]
    lines += [
        "f " + " ".join(str(i) for i in range(n, 0, -1)),
        "f " + " ".join(str(n + i + 1) for i in range(n)),
    ]
    lines += [f"f {i + 1} {(i + 1) % n + 1} {(i + 1) % n + n + 1} {i + n + 1}" for i in range(n)]
    file = read("notch.obj", "\n".join(lines).encode())
    assert volume(file) == pytest.approx(10 * (1600 - 4 * 35 / 2))
    area = (
        np.linalg.norm(np.cross(*np.diff(file.objects[0].triangles, axis=1).swapaxes(0, 1)), axis=1).sum() / 2
    )
    around = sum(
        np.hypot(*np.subtract(a, b)) for a, b in zip(outline, outline[1:] + outline[:1], strict=True)
    )
    assert area == pytest.approx(2 * 1530 + 10 * around)


def test_names_of_an_obj_may_be_in_any_encoding_and_its_materials_are_not_opened(tmp_path):
    secret = tmp_path / "secret.mtl"
    secret.symlink_to("/dev/zero")  # reading it would never end
    head = f"mtllib {secret}\no ".encode() + "Gehäuse".encode("latin-1") + b"\nusemtl r\xf6t\n"
    assert volume(read("cube.obj", head + CUBE_OBJ.encode())) == pytest.approx(1000)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "refers to a missing vertex"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -9\n", "refers to a missing vertex"),
        ("v 0 0 0\nv 1 0 0\nf 0 1 2\nv 0 1 0\n", "line 3"),
        ("v 0 0 0\nv 1 0\n", "line 2"),
        ("v 0 0 0\nv 1 0 zero\nv 0 1 0\nf 1 2 3\n", "not a readable OBJ"),
        ("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("v 0 0 0\nv 1 0 1e999\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("f one two three\n", "line 1"),
        ("v 0 0 0\nv 1 0 0\n", "holds no triangles"),
        ("Dear colleague\n", "holds no vertices"),
    ],
)
def test_a_damaged_obj_is_refused(text, said):
    assert said in refusal("part.obj", text.encode())
