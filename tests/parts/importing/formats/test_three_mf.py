"""3MF from real bytes; damaged and hostile files are refused with the reason."""

import io
import struct
import zipfile
import zlib

import numpy as np
import pytest
import trimesh

from tests.parts.importing.reading import read, refusal, volume

BOX = trimesh.creation.box((40, 30, 20))


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
    item = '<item objectid="8"/>'
    assert volume(read("sliced.3mf", three_mf(model(main, item), model(ten, "")))) == pytest.approx(1000)
    inches = three_mf(model(main, item, root='unit="inch"'), model(ten, ""))
    assert volume(read("sliced.3mf", inches)) == pytest.approx(1000 * 25.4**3)
    mixed = three_mf(model(main, item, root='unit="inch"'), model(ten, "", root='unit="meter"'))
    assert "states several units, inch and meter" in refusal("sliced.3mf", mixed)


def test_elements_of_extensions_are_not_taken_for_those_of_the_core_specification():
    slices = (
        '<s:slicestack id="5"><s:slice ztop="1"><s:vertices><s:vertex x="0" y="0"/></s:vertices></s:slice>'
        "</s:slicestack>"
    )
    root = 'xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"'
    ten = f'<object id="1" s:slicestackid="5">{mesh_xml(trimesh.creation.box((10, 10, 10)))}</object>'
    content = model(slices + ten, ITEM, root=root)
    assert volume(read("sliced.3mf", three_mf(content))) == pytest.approx(1000)
    # The same with a prefix for the core specification, and the extension as the namespace without one.
    other = content.replace(f'xmlns="{CORE}"', f'xmlns:c="{CORE}"').replace("xmlns:s=", "xmlns=")
    for word in (
        "model",
        "resources",
        "object",
        "mesh",
        "vertices",
        "vertex",
        "triangles",
        "triangle",
        "build",
    ):
        for start in ("<", "</"):
            other = other.replace(f"{start}{word} ", f"{start}c:{word} ").replace(
                f"{start}{word}>", f"{start}c:{word}>"
            )
    other = other.replace("<item ", "<c:item ").replace("<s:", "<").replace("</s:", "</")
    other = other.replace("s:slicestackid", "slicestackid")
    assert "<vertex x" in other and "<c:vertex x" in other
    assert volume(read("sliced.3mf", three_mf(other))) == pytest.approx(1000)


def test_a_3mf_without_namespaces_or_of_an_older_draft_is_read():
    for space in ("", 'xmlns="http://schemas.microsoft.com/3dmanufacturing/2013/01"'):
        content = model(CUBE, ITEM, root='unit="inch"').replace(f'xmlns="{CORE}"', space)
        assert volume(read("old.3mf", three_mf(content))) == pytest.approx(25.4**3)


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
