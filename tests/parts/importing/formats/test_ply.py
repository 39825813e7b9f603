"""PLY from real bytes; damaged files are refused with the reason."""

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
