"""CAD files."""

from __future__ import annotations

import io
import os
import zipfile

import trimesh

from tests.inputs.row import Place, Row

PLY = """ply
format ascii 1.0
element vertex 1000000000
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
"""


def _box(*size: float) -> bytes:
    content = trimesh.creation.box(size).export(file_type="stl")
    assert isinstance(content, bytes)
    return content


def _two() -> bytes:
    boxes = [trimesh.creation.box((30, 20, 10)), trimesh.creation.box((30, 20, 10))]
    boxes[1].apply_translation((60, 0, 0))
    content = trimesh.util.concatenate(boxes).export(file_type="stl")
    assert isinstance(content, bytes)
    return content


def _zip_bomb() -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("3D/3dmodel.model", b" " * 2**28)
    return packed.getvalue()


def _import(name: str, file: str, content: bytes | str, says: str, *options: str, code: int = 1) -> Row:
    return Row("parts", name, lambda at: ["import", at.file(file, content), *options], says, code, also=True)


def _import_bomb(at: Place) -> list[str]:
    return ["import", at.file("a.3mf", _zip_bomb())]


def _raw_name(at: Place) -> list[str]:
    folder = at.folder / "cad"
    folder.mkdir()
    for name in (b"a\xff.stl", b"b.stl"):
        with open(os.path.join(os.fsencode(folder), name), "wb") as file:
            file.write(_box(30, 20, 10) if name == b"b.stl" else b"")
    return ["import", str(folder), "--workers", "1"]


ROWS = [
    _import("a sheet thinner than a hull", "sheet.stl", _box(50, 30, 0.05), "sheet.stl.*thick|thin"),
    _import("the name of a set", "box.stl", _box(30, 20, 10), "'test' .*set", "--name", "test"),
    _import("a file named as a set", "starter.stl", _box(30, 20, 10), "'starter' .*set"),
    _import(
        "the name of a built-in part",
        "box.stl",
        _box(30, 20, 10),
        "belongs to a built-in part",
        "--name",
        "hex_nut_m30",
    ),
    _import("nothing", "a.stl", b"", "a.stl"),
    _import("four billion triangles", "a.stl", b"x" * 80 + b"\xff\xff\xff\xff" + b"0" * 500, "a.stl"),
    _import("a vertex that is no number", "a.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj"),
    _import("a vertex that does not exist", "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "a.obj"),
    _import("a header of a billion vertices", "a.ply", PLY, "a.ply"),
    Row("parts", "an archive that unpacks to a quarter of a gigabyte", _import_bomb, "a.3mf", 1, also=True),
    _import("a scene that is no scene", "a.glb", b"glTF\x02\0\0\0\xff\xff\xff\xff", "a.glb"),
    _import("a drawing that is no drawing", "a.step", "ISO-10303-21;\nHEADER;", "a.step|cascadio"),
    _import("a file of another kind", "a.txt", "hello", "suffix '.txt'"),
    _import(
        "a part of a hundredth of a millimetre", "a.stl", _box(0.01, 0.01, 0.01), "the limits are 2 to 500 mm"
    ),
    _import("two bodies", "a.stl", _two(), "--split"),
    _import(
        "a density in other units",
        "a.stl",
        _box(30, 20, 10),
        "--density: .*not g/cm",
        "--density",
        "7.85",
        code=2,
    ),
    _import(
        "a density that is no number", "a.stl", _box(30, 20, 10), "--density: ", "--density", "nan", code=2
    ),
    _import("a family with an escape", "a\x1b[31m\n\u202e.stl", b"", r"a\\x1b\[31m\\n\\u202e.stl"),
    Row("parts", "a name that is no text", _raw_name, r"a\\(x|udc)ff.stl", 1, also=True),
    Row("parts", "no such file", lambda at: ["import", "no.stl"], "no.stl", 2),
    Row(
        "plan",
        "two bodies",
        lambda at: ["--part", at.file("a.stl", _two())],
        "(?=.*mskgrasp.parts import)(?!.*: choose --split)",
        1,
    ),
    Row(
        "assess", "a drawing that is no drawing", lambda at: [at.file("a.stl", "solid nothing\n")], "a.stl", 1
    ),
]
