"""GLB from real bytes; damaged and hostile files are refused with the reason."""

import json
import struct

import numpy as np
import pytest
import trimesh

from tests.parts.importing.reading import read, refusal, volume

BOX = trimesh.creation.box((40, 30, 20))


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


def test_a_glb_too_far_from_its_origin_for_its_numbers_is_refused_and_one_that_a_node_moves_is_not():
    small = trimesh.creation.box((0.04, 0.03, 0.02))
    moved = trimesh.Scene()
    moved.add_geometry(small, transform=trimesh.transformations.translation_matrix((1000, 0, 0)))
    assert volume(read("moved.glb", glb(moved))) == pytest.approx(24_000, rel=1e-6)
    far = small.copy()
    far.apply_translation((1000, 0, 0))
    message = refusal("far.glb", glb(trimesh.Scene([far])))
    assert "lies 24,976 times its length from its origin" in message and "move it to the origin" in message
    back = trimesh.Scene()
    back.add_geometry(far, transform=trimesh.transformations.translation_matrix((-1000, 0, 0)))
    assert "move it to the origin" in refusal("back.glb", glb(back))


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
    assert "holds no triangles" in refusal("box.glb", empty)
