"""Every format a user may bring, read from real bytes; damaged and hostile files are refused in words."""

import io
import json
import struct
import zipfile
import zlib

import numpy as np
import pytest
import trimesh

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.importing.mesh_files import read_content
from tests.parts.reading import read, refusal, volume

BOX = trimesh.creation.box((40, 30, 20))


# STL


def stl(mesh: trimesh.Trimesh) -> bytes:
    return bytes(mesh.export(file_type="stl"))


def test_a_binary_stl_whose_header_says_solid_is_read_as_binary():
    content = b"solid by CAD".ljust(80) + stl(BOX)[80:]
    assert volume(read("box.stl", content)) == pytest.approx(24_000, rel=1e-6)


def test_a_text_stl_of_several_solids_in_capitals_is_read():
    text = "".join(
        f"SOLID {name}\n"
        + "".join(
            "FACET NORMAL 0 0 0\n OUTER LOOP\n"
            + "".join(f"  VERTEX {x:.9e} {y:.9e} {z:.9e}\n" for x, y, z in triangle + shift)
            + " ENDLOOP\nENDFACET\n"
            for triangle in BOX.triangles
        )
        + f"ENDSOLID {name}\r\n"
        for name, shift in (("a", 0.0), ("b", 100.0))
    )
    assert volume(read("two.stl", text.encode())) == pytest.approx(48_000)
    assert "is cut off: no endsolid" in refusal("two.stl", text.encode()[: len(text) // 2])


def test_bytes_after_the_last_triangle_are_ignored_and_reported():
    file = read("box.stl", stl(BOX) + b"made by a CAD program")
    assert volume(file) == pytest.approx(24_000, rel=1e-6)
    assert file.notes == ("ignored 21 bytes after the last triangle",)


def test_a_cut_off_stl_says_what_was_stated_and_what_came():
    content = stl(BOX)
    message = refusal("box.stl", content[: 84 + 50 * 5 + 17])
    assert "states 12 triangles" in message and "ends after 5" in message
    lying = content[:80] + struct.pack("<I", 10**9) + content[84:]
    assert "states 1,000,000,000 triangles" in refusal("box.stl", lying)


def test_a_text_named_stl_is_called_a_text():
    assert "is not an STL (text" in refusal(
        "letter.stl", b"Dear colleague, please find the part attached.\n" * 9
    )
    assert "is not an STL" in refusal("letter.stl", b"hello")


def test_an_stl_too_far_from_its_origin_for_its_numbers_is_refused():
    far = BOX.copy()
    far.apply_translation((1e7, 0, 0))
    assert "move it to the origin" in refusal("far.stl", stl(far))
    near = BOX.copy()
    near.apply_translation((1e3, 0, 0))
    assert volume(read("near.stl", stl(near))) == pytest.approx(24_000, rel=1e-4)


# OBJ

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


# PLY


def test_a_ply_that_claims_a_thousand_million_vertices_is_refused_at_once():
    content = bytes(BOX.export(file_type="ply"))
    assert volume(read("box.ply", content)) == pytest.approx(24_000)
    lying = content.replace(b"element vertex 8", b"element vertex 1000000000")
    assert "is not a readable PLY" in refusal("box.ply", lying)


def test_a_ply_of_points_alone_has_no_triangles():
    points = trimesh.PointCloud(BOX.vertices).export(file_type="ply")
    assert "holds no triangles" in refusal("cloud.ply", bytes(points))


# GLB


def glb(scene: trimesh.Scene) -> bytes:
    return bytes(scene.export(file_type="glb"))


def with_json(content: bytes, change) -> bytes:
    """The GLB with its JSON changed."""
    size = struct.unpack_from("<I", content, 12)[0]
    tree = json.loads(content[20 : 20 + size])
    change(tree)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    rest = content[20 + size :]
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest


def test_instances_of_a_glb_lie_where_its_nodes_put_them_and_mirrored_ones_stay_right_side_out():
    wedge = trimesh.convex.convex_hull([[0, 0, 0], [0.03, 0, 0], [0, 0.02, 0], [0, 0, 0.04]])
    scene = trimesh.Scene()
    scene.add_geometry(wedge)
    mirror = np.diag([-2.0, 2.0, 2.0, 1.0])
    mirror[:3, 3] = [0.1, 0.0, 0.0]
    scene.graph.update(frame_to="second", matrix=mirror, geometry=next(iter(scene.geometry)))
    file = read("scene.glb", glb(scene))
    assert sorted(item.volume for item in file.objects) == pytest.approx([4_000, 32_000], rel=1e-5)
    assert max(item.vertices[:, 0].max() for item in file.objects) == pytest.approx(100, rel=1e-5)
    assert file.unit == "m"


def test_a_glb_in_millimetres_is_found_out_by_its_size_and_read_with_unit():
    content = glb(trimesh.Scene([BOX]))
    message = refusal("box.glb", content)
    assert "is 40 m long when read in m" in message and "--unit mm would make it 40 mm" in message
    file = read("box.glb", content, "mm")
    assert volume(file) == pytest.approx(24_000, rel=1e-5)
    assert file.notes == ("read in mm as --unit says; GLB is in m by its standard",)


def test_a_hostile_or_foreign_glb_is_refused():
    content = glb(trimesh.Scene([BOX]))
    outside = with_json(content, lambda tree: tree["buffers"][0].update(uri="/etc/passwd"))
    assert "keeps its geometry in another file" in refusal("box.glb", outside)
    packed = with_json(content, lambda tree: tree.update(extensionsRequired=["KHR_draco_mesh_compression"]))
    assert "is compressed (KHR_draco_mesh_compression)" in refusal("box.glb", packed)

    def claim(tree):
        del tree["accessors"][0]["bufferView"]
        tree["accessors"][0]["count"] = 10**10

    assert "array without data" in refusal("box.glb", with_json(content, claim))
    looped = with_json(content, lambda tree: tree["nodes"][-1].update(children=[len(tree["nodes"]) - 1]))
    assert "is its own" in refusal("box.glb", looped, "mm")
    assert "is cut off" in refusal("box.glb", content[:-100])
    assert "is not a GLB" in refusal("box.glb", b"glTX" + content[4:])
    assert "version 1" in refusal("box.glb", content[:4] + struct.pack("<I", 1) + content[8:])
    empty = with_json(content, lambda tree: [tree.pop(key) for key in ("meshes", "nodes", "scenes", "scene")])
    assert "GLB" in refusal("box.glb", empty) or "triangles" in refusal("box.glb", empty)


# 3MF

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"


def mesh_xml(mesh: trimesh.Trimesh) -> str:
    vertices = "".join(f'<vertex x="{x:.17g}" y="{y:.17g}" z="{z:.17g}"/>' for x, y, z in mesh.vertices)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces)
    return f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"


def model(objects: str, items: str, head: str = "", root: str = "") -> str:
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>{head}<model {root} xmlns="{CORE}">'
        f"<resources>{objects}</resources><build>{items}</build></model>"
    )


def three_mf(*models: str) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for number, text in enumerate(models):
            archive.writestr("3D/3dmodel.model" if number == 0 else f"3D/Objects/{number}.model", text)
    return file.getvalue()


CUBE = f'<object id="1" type="model">{mesh_xml(trimesh.creation.box((1, 1, 1)))}</object>'
ITEM = '<item objectid="1"/>'


@pytest.mark.parametrize(
    ("stated", "edge"),
    [("", 1.0), ('unit="inch"', 25.4), ('unit="centimeter"', 10.0), ('unit="foot"', 304.8)],
)
def test_a_3mf_is_in_the_unit_that_it_states_and_in_millimetres_where_it_states_none(stated, edge):
    size = 30 / edge if edge < 2 else 1.0
    cube = f'<object id="1">{mesh_xml(trimesh.creation.box((size, size, size)))}</object>'
    assert volume(read("cube.3mf", three_mf(model(cube, ITEM, root=stated)))) == pytest.approx(
        (size * edge) ** 3
    )


def test_a_unit_that_contradicts_a_3mf_is_refused_and_the_same_unit_is_not():
    content = three_mf(model(CUBE, ITEM, root='unit="inch"'))
    assert "states its own unit, in, and --unit says mm: omit --unit" in refusal("a.3mf", content, "mm")
    assert volume(read("a.3mf", content, "in")) == pytest.approx(25.4**3)


def test_components_of_a_3mf_are_placed_by_all_their_transforms():
    # A cube of 10 mm, doubled along x by the component, turned by 90 degrees about z and moved by the item.
    ten = f'<object id="1">{mesh_xml(trimesh.creation.box(bounds=[(0, 0, 0), (10, 10, 10)]))}</object>'
    pair = (
        '<object id="2"><components><component objectid="1"/>'
        '<component objectid="1" transform="2 0 0 0 1 0 0 0 1 20 0 0"/></components></object>'
    )
    item = '<item objectid="2" transform="0 1 0 -1 0 0 0 0 1 100 0 0"/>'
    file = read("pair.3mf", three_mf(model(ten + pair, item)))
    assert [item.volume for item in file.objects] == pytest.approx([1000, 2000])
    assert np.allclose(file.objects[1].vertices.min(axis=0), [90, 20, 0])
    assert np.allclose(file.objects[1].vertices.max(axis=0), [100, 40, 10])


def test_a_3mf_may_keep_its_objects_in_further_models_as_slicers_do():
    main = (
        '<object id="8"><components><component p:path="/3D/Objects/1.model" objectid="1" '
        'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"/></components></object>'
    )
    ten = f'<object id="1">{mesh_xml(trimesh.creation.box((10, 10, 10)))}</object>'
    content = three_mf(model(main, '<item objectid="8"/>'), model(ten, ""))
    assert volume(read("sliced.3mf", content)) == pytest.approx(1000)


def test_supports_of_a_3mf_are_left_out_and_reported():
    ten = f'<object id="1">{mesh_xml(trimesh.creation.box((10, 10, 10)))}</object>'
    support = ten.replace('id="1"', 'id="2" type="support"')
    file = read("a.3mf", three_mf(model(ten + support, ITEM + '<item objectid="2"/>')))
    assert volume(file) == pytest.approx(1000) and file.notes == ("left out 1 support object",)


def test_a_hostile_or_damaged_3mf_is_refused():
    laughs = '<!DOCTYPE m [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>'
    assert "has a DTD" in refusal("a.3mf", three_mf(model(CUBE, ITEM, head=laughs)))
    # Ten components of ten components of ...: 10^12 cubes from a few lines.
    nested = CUBE + "".join(
        f'<object id="{level}"><components>'
        + 10 * f'<component objectid="{level - 1}"/>'
        + "</components></object>"
        for level in range(2, 14)
    )
    assert "export one part alone" in refusal("a.3mf", three_mf(model(nested, '<item objectid="13"/>')))
    circle = '<object id="1"><components><component objectid="1"/></components></object>'
    assert "export one part alone" in refusal("a.3mf", three_mf(model(circle, ITEM)))
    assert "missing object '7'" in refusal("a.3mf", three_mf(model(CUBE, '<item objectid="7"/>')))
    assert "XML" in refusal("a.3mf", three_mf(model(CUBE, ITEM)[:-20]))
    assert "attribute 'x'" in refusal(
        "a.3mf", three_mf(model(CUBE, ITEM).replace('<vertex x="', '<vertex w="'))
    )
    assert "unit 'parsec'" in refusal("a.3mf", three_mf(model(CUBE, ITEM, root='unit="parsec"')))
    lattice = (
        'xmlns:b="http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02" requiredextensions="b"'
    )
    assert "beamlattice" in refusal("a.3mf", three_mf(model(CUBE, ITEM, root=lattice)))
    content = three_mf(model(CUBE, ITEM))
    assert "not a readable 3MF" in refusal("a.3mf", content[: len(content) // 2])
    assert "3dmodel.model is missing" in refusal("a.3mf", content.replace(b"3dmodel", b"3dmadel"))
    assert "holds no triangles" in refusal("a.3mf", three_mf(model(CUBE, "")))


def test_a_zip_bomb_named_3mf_is_refused_before_it_is_unfolded():
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w") as archive:
        archive.writestr("3D/3dmodel.model", b"")
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = packer.compress(bytes(1 << 20)) + packer.flush()
    content = bytearray(bomb.getvalue())
    at = content.index(b"PK\1\2")  # the central directory: sizes at 20 and 24
    struct.pack_into("<II", content, at + 20, len(packed), 3 << 30)
    assert "unpacks to 3.0 GiB, the most is 1" in refusal("bomb.3mf", bytes(content))


@pytest.mark.parametrize(
    ("edge", "said"),
    [
        (
            0.06,
            "is 0.06 mm long when read in mm; the limits are 2 to 500 mm: --unit m would make it 60 mm",
        ),
        (1.5, "--unit in would make it 38.1 mm"),
        (1000.0, "no other --unit makes it fit"),
        (1e-9, "no other --unit makes it fit"),
        (1e30, "no other --unit makes it fit"),
    ],
)
def test_an_impossible_size_is_refused_with_the_unit_that_would_be_right(edge, said):
    assert said in refusal(
        "cube.ply", bytes(trimesh.creation.box((edge, edge, edge)).export(file_type="ply"))
    )


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("part.sldprt", "CAD files end in .stl"),
        ("part", "has the suffix '(none)'"),
        ("missing.stl", "No such file"),
        ("file.stl/inner.stl", "Not a directory"),
        ("folder.stl", "is a folder"),
        ("null.stl", "is a device"),
        ("empty.stl", "is empty"),
        ("blank.obj", "is empty"),
    ],
)
def test_what_is_no_file_of_a_known_kind_is_refused_before_reading(tmp_path, name, said):
    (tmp_path / "folder.stl").mkdir()
    (tmp_path / "null.stl").symlink_to("/dev/null")
    (tmp_path / "empty.stl").touch()
    (tmp_path / "file.stl").write_bytes(b"x")
    (tmp_path / "blank.obj").write_text("\n \n")
    with pytest.raises(BadPart, match=".*") as caught:
        read_content(tmp_path / name)
    assert said in str(caught.value) and "\n" not in str(caught.value)
