"""PLY from real bytes; damaged files are refused with the reason."""

import pytest
import trimesh

from tests.parts.importing.reading import read, refusal, volume

BOX = trimesh.creation.box((40, 30, 20))


def test_a_ply_that_claims_a_thousand_million_vertices_is_refused_at_once():
    content = bytes(BOX.export(file_type="ply"))
    assert volume(read("box.ply", content)) == pytest.approx(24_000)
    lying = content.replace(b"element vertex 8", b"element vertex 1000000000")
    assert "is not a readable PLY" in refusal("box.ply", lying)


def test_a_ply_of_points_alone_has_no_triangles():
    points = trimesh.PointCloud(BOX.vertices).export(file_type="ply")
    assert "holds no triangles" in refusal("cloud.ply", bytes(points))
